// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/feature_budget.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

PanoramaModel Ring(int cameras) {
  return test::MakePanorama(test::RingRig(cameras, 0.1, test::MakeWideCamera(2.1, 400)));
}

// A corner in every block of every camera whose direction is `in_view`: more than enough there.
template <typename InView>
std::vector<std::vector<Corner>> CornersWhere(const PanoramaModel& model,
                                              const FeatureBudget& budget, const InView& in_view) {
  RandomStream random(1);
  std::vector<std::vector<Corner>> corners(static_cast<std::size_t>(model.cameras()));
  for (int camera = 0; camera < model.cameras(); ++camera) {
    const RegionMap& map = budget.regions(camera);
    for (int row = 0; row < map.rows(); ++row) {
      for (int column = 0; column < map.columns(); ++column) {
        if (map.At(column, row) == RegionMap::kNone) continue;
        const auto seen = model.Lift(camera, map.Center(column, row));
        if (!seen || !in_view(seen->point.normalized())) continue;
        corners[static_cast<std::size_t>(camera)].push_back(
            {.pixel = map.Center(column, row),
             .region = map.At(column, row),
             .texture = 50.0,
             .position_sigma = random.Uniform(0.1, 1.0)});
      }
    }
  }
  return corners;
}

std::vector<std::vector<Corner>> CornersEverywhere(const PanoramaModel& model,
                                                   const FeatureBudget& budget) {
  return CornersWhere(model, budget, [](const Eigen::Vector3d&) { return true; });
}

std::vector<Eigen::Vector3d> PointsOf(std::span<const PanoramicObservation> observations) {
  std::vector<Eigen::Vector3d> points;
  for (const PanoramicObservation& o : observations) points.push_back(o.point);
  return points;
}

// The number of features, and with it the cost, does not depend on the number of cameras.
TEST(FeatureBudget, IsOneNumberForTheWholeSphere) {
  for (const int cameras : {1, 2, 4, 6}) {
    const PanoramaModel model = Ring(cameras);
    const FeatureBudget budget(model, 300);
    // Cells cut by the rim of what is seen count, too: more of them where the rim is long.
    EXPECT_GT(budget.visible_cells(), 290) << cameras;
    EXPECT_LT(budget.visible_cells(), 450) << cameras;
    const auto selected = budget.Select(model, CornersEverywhere(model, budget), {});
    EXPECT_GE(selected.size(), 300U) << cameras;
    EXPECT_LT(selected.size(), 400U) << cameras;
  }
}

// A view of a few pixels gets no more cells than blocks of the region map would fill the sphere.
TEST(FeatureBudget, ATinyViewDoesNotMakeMillionsOfCells) {
  for (const double valid_radius_px : {0.5, 5.0, 20.0}) {
    Rig rig = test::RingRig(1, 0.0, test::MakeWideCamera(2.1, 400));
    rig.cameras[0].valid_radius_px = valid_radius_px;
    const FeatureBudget budget(test::MakePanorama(rig), 250);
    const double focal = 199.0 / 1.05, block = 8.0 / focal;
    EXPECT_LE(budget.cells().size(), 4.0 * M_PI / (block * block)) << valid_radius_px;
    EXPECT_GT(budget.cells().size(), 250) << valid_radius_px;
  }
}

// Where there are corners everywhere, nearly all cells get one; existing features count.
TEST(FeatureBudget, FillsEmptyCellsFirst) {
  const PanoramaModel model = Ring(4);
  const FeatureBudget budget(model, 300);
  const auto corners = CornersEverywhere(model, budget);
  const auto all = budget.Select(model, corners, {});
  std::vector<Eigen::Vector3d> features;
  for (std::size_t i = 0; i < all.size(); i += 2) features.push_back(all[i].point);
  const auto added = budget.Select(model, corners, features);
  std::map<int, int> count;
  for (const Eigen::Vector3d& point : features) ++count[budget.CellOf(point)];
  for (const Eigen::Vector3d& point : PointsOf(added)) ++count[budget.CellOf(point)];
  int most = 0;
  for (const auto& [cell, number] : count) most = std::max(most, number);
  EXPECT_GT(count.size(), 0.8 * budget.visible_cells());
  EXPECT_LE(most, 2);
  for (const Eigen::Vector3d& point : PointsOf(added)) {
    for (const Eigen::Vector3d& feature : features) {
      EXPECT_LE(point.normalized().dot(feature.normalized()),
                std::cos(budget.min_distance_in_cell()) + 1e-12);
    }
    features.push_back(point);
  }
}

// With corners on a third of the sphere only the budget is used up there, evenly: no cell has two
// more than another, but for those that are cut by the rim.
TEST(FeatureBudget, IsUsedUpWhereThereAreCorners) {
  const PanoramaModel model = Ring(4);
  const FeatureBudget budget(model, 300);
  const auto corners = CornersWhere(model, budget, [](const Eigen::Vector3d& d) {
    return std::abs(std::atan2(d.y(), d.x())) < M_PI / 3.0;
  });
  const auto selected = budget.Select(model, corners, {});
  EXPECT_GT(selected.size(), 270U);
  EXPECT_LE(selected.size(), 300U);
  std::map<int, int> count;
  for (const Eigen::Vector3d& point : PointsOf(selected)) ++count[budget.CellOf(point)];
  int few = 0;
  for (const auto& [cell, number] : count) {
    EXPECT_LE(number, FeatureBudget::kPartsPerCell);
    few += number < 2 ? 1 : 0;
  }
  EXPECT_LT(few, 0.25 * static_cast<double>(count.size()));
}

// The best corner of a cell is the one whose window is found best, not the one of most contrast.
TEST(FeatureBudget, TakesTheBestOfACell) {
  const PanoramaModel model = Ring(4);
  const FeatureBudget budget(model, 300);
  const auto corners = CornersEverywhere(model, budget);
  std::map<int, double> best;
  for (const auto& camera : corners) {
    for (const Corner& corner : camera) {
      const auto [entry, is_new] = best.try_emplace(budget.CellOfPart(corner.region), 10.0);
      entry->second = std::min(entry->second, corner.position_sigma);
    }
  }
  const auto first = budget.Select(model, corners, {}).front();
  double least = 10.0;
  for (const auto& [cell, sigma] : best) least = std::min(least, sigma);
  EXPECT_EQ(best[budget.CellOf(first.point)], least);
}

TEST(FeatureBudget, WantsWhatIsMissing) {
  const PanoramaModel model = Ring(4);
  const FeatureBudget budget(model, 300);
  const std::vector<std::uint8_t> all(static_cast<std::size_t>(budget.cells().size()), 1);
  const auto points = PointsOf(budget.Select(model, CornersEverywhere(model, budget), {}));
  // Not full: every part without a feature; full: those of empty cells only.
  const std::span<const Eigen::Vector3d> few(points.data(), 10);
  const auto wanted = budget.WantedParts(few, all);
  EXPECT_EQ(std::count(wanted.begin(), wanted.end(), 0), 10);
  const auto last = budget.WantedParts(points, all);
  std::set<int> occupied;
  for (const Eigen::Vector3d& point : points) occupied.insert(budget.CellOf(point));
  for (std::size_t part = 0; part < last.size(); ++part) {
    const bool empty = !occupied.contains(budget.CellOfPart(static_cast<int>(part)));
    EXPECT_EQ(last[part] != 0, empty) << part;
  }
  const std::vector<std::uint8_t> none(all.size(), 0);
  const auto not_due = budget.WantedParts(few, none);
  EXPECT_EQ(std::count(not_due.begin(), not_due.end(), 1), 0);
}

}  // namespace
}  // namespace mlvi

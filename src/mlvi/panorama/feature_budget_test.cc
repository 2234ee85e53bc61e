// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/feature_budget.h"

#include <gtest/gtest.h>

#include <set>

#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

PanoramaModel Ring(int cameras) {
  return test::MakePanorama(test::RingRig(cameras, 0.1, test::MakeWideCamera(2.1, 400)));
}

// A corner in every block of every camera: more than enough everywhere.
std::vector<std::vector<Corner>> CornersEverywhere(const PanoramaModel& model,
                                                   const FeatureBudget& budget) {
  RandomStream random(1);
  std::vector<std::vector<Corner>> corners(static_cast<std::size_t>(model.cameras()));
  for (int camera = 0; camera < model.cameras(); ++camera) {
    const RegionMap& map = budget.regions(camera);
    for (int row = 0; row < map.rows(); ++row) {
      for (int column = 0; column < map.columns(); ++column) {
        if (map.At(column, row) == RegionMap::kNone) continue;
        corners[static_cast<std::size_t>(camera)].push_back(
            {map.Center(column, row), map.At(column, row), random.Uniform(10.0, 100.0)});
      }
    }
  }
  return corners;
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
    EXPECT_GT(selected.size(), 220U) << cameras;
    EXPECT_LT(selected.size(), 400U) << cameras;
  }
}

TEST(FeatureBudget, SelectsOnePerCellApartFromOthers) {
  const PanoramaModel model = Ring(4);
  const FeatureBudget budget(model, 300);
  const auto corners = CornersEverywhere(model, budget);
  const auto first = budget.Select(model, corners, {});
  std::vector<Eigen::Vector3d> features;
  std::set<int> cells;
  for (std::size_t i = 0; i < first.size(); i += 2) {
    features.push_back(first[i].point);
    cells.insert(budget.cells().CellOf(first[i].point));
  }
  const std::vector<std::uint8_t> empty = budget.EmptyCells(features);
  for (const PanoramicObservation& o : budget.Select(model, corners, features)) {
    const int cell = budget.cells().CellOf(o.point);
    EXPECT_EQ(empty[static_cast<std::size_t>(cell)], 1);
    EXPECT_TRUE(cells.insert(cell).second);
    for (const Eigen::Vector3d& feature : features) {
      EXPECT_LE(o.point.normalized().dot(feature.normalized()),
                std::cos(budget.min_distance()) + 1e-12);
    }
    features.push_back(o.point);
  }
}

}  // namespace
}  // namespace mlvi

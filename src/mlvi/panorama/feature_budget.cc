// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/feature_budget.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

// Cells of the sphere that tells how much of it the cameras see: 1.4 degrees.
constexpr int kCoverageCells = 20000;

// The share of the sphere that at least one camera sees, at infinity.
double Coverage(const PanoramaModel& model) {
  const EqualAreaSphere sphere(kCoverageCells);
  const int seen = ParallelReduce(
      static_cast<std::size_t>(sphere.size()), 1000, 0,
      [&](std::size_t begin, std::size_t end) {
        int count = 0;
        for (std::size_t cell = begin; cell < end; ++cell) {
          const Eigen::Vector3d direction = sphere.Center(static_cast<int>(cell));
          for (int camera = 0; camera < model.cameras(); ++camera) {
            if (!model.ProjectDirection(camera, direction)) continue;
            ++count;
            break;
          }
        }
        return count;
      },
      [](int& sum, int count) { sum += count; });
  return std::max(seen, 1) / static_cast<double>(sphere.size());
}

// Cells smaller than a block of the region maps, in the middle of the lens that resolves most, would
// be cells that no image can fill: a view may be tiny (a mask, a valid radius).
double MostCells(const PanoramaModel& model) {
  double finest = 0.0;  // px^2/sr
  for (int camera = 0; camera < model.cameras(); ++camera) {
    CameraModel::PointJacobian d_axis;
    if (!model.camera(camera).Project(Eigen::Vector3d::UnitZ(), &d_axis)) continue;
    finest = std::max(finest, std::abs(d_axis.leftCols<2>().determinant()));
  }
  if (finest == 0.0) return std::numeric_limits<double>::infinity();  // no lens sees its own axis
  return 4.0 * std::numbers::pi * finest / (RegionMap::kBlock * RegionMap::kBlock);
}

int CellsFor(const PanoramaModel& model, int budget) {
  return std::max(
      2, static_cast<int>(std::min(std::round(budget / Coverage(model)), MostCells(model))));
}

RegionMap MapRegions(const PanoramaModel& model, int camera, const EqualAreaSphere& cells) {
  RegionMap map(model.camera(camera).width(), model.camera(camera).height());
  ParallelFor(static_cast<std::size_t>(map.rows()), 8, [&](std::size_t index) {
    const int row = static_cast<int>(index);
    for (int column = 0; column < map.columns(); ++column) {
      const auto observation = model.Lift(camera, map.Center(column, row));
      if (observation) map.At(column, row) = cells.CellOf(observation->point);
    }
  });
  return map;
}

// The cells that some camera sees a part of.
int CountCells(const std::vector<RegionMap>& maps, std::span<const int> cell_of_part, int cells) {
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(cells));
  for (const RegionMap& map : maps) {
    for (int row = 0; row < map.rows(); ++row) {
      for (int column = 0; column < map.columns(); ++column) {
        const int part = map.At(column, row);
        if (part == RegionMap::kNone) continue;
        seen[static_cast<std::size_t>(cell_of_part[static_cast<std::size_t>(part)])] = 1;
      }
    }
  }
  return static_cast<int>(std::count(seen.begin(), seen.end(), 1));
}

// A corner that some camera found, and its place on the sphere.
struct Candidate {
  PanoramicObservation observation;
  Eigen::Vector3d direction;
  double position_sigma = 0.0;
  int cell = 0;
  bool taken = false;
};

std::vector<Candidate> LiftCorners(const PanoramaModel& model, const FeatureBudget& budget,
                                   std::span<const std::vector<Corner>> corners) {
  std::vector<Candidate> candidates;
  for (std::size_t camera = 0; camera < corners.size(); ++camera) {
    for (const Corner& corner : corners[camera]) {
      const auto observation = model.Lift(static_cast<int>(camera), corner.pixel);
      if (!observation) continue;
      candidates.push_back({.observation = *observation,
                            .direction = observation->point.normalized(),
                            .position_sigma = corner.position_sigma,
                            .cell = budget.CellOfPart(corner.region)});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.position_sigma < b.position_sigma;
  });
  return candidates;
}

bool Crowded(const Eigen::Vector3d& direction, std::span<const Eigen::Vector3d> taken,
             double min_distance) {
  const double nearest = std::cos(min_distance);
  return std::any_of(taken.begin(), taken.end(),
                     [&](const Eigen::Vector3d& other) { return other.dot(direction) > nearest; });
}

}  // namespace

FeatureBudget::FeatureBudget(const PanoramaModel& model, int budget)
    : budget_(budget), cells_(CellsFor(model, budget)), parts_(kPartsPerCell * cells_.size()) {
  MLVI_CHECK(budget >= 1, "budget of {} features", budget);
  for (int part = 0; part < parts_.size(); ++part) {
    cell_of_part_.push_back(cells_.CellOf(parts_.Center(part)));
  }
  for (int camera = 0; camera < model.cameras(); ++camera) {
    regions_.push_back(MapRegions(model, camera, parts_));
  }
  visible_ = CountCells(regions_, cell_of_part_, cells_.size());
}

std::vector<int> FeatureBudget::CountPerCell(std::span<const Eigen::Vector3d> features) const {
  std::vector<int> count(static_cast<std::size_t>(cells_.size()));
  for (const Eigen::Vector3d& feature : features) {
    ++count[static_cast<std::size_t>(CellOf(feature))];
  }
  return count;
}

std::vector<std::uint8_t> FeatureBudget::WantedParts(std::span<const Eigen::Vector3d> features,
                                                     std::span<const std::uint8_t> cell_due) const {
  const std::vector<int> count = CountPerCell(features);
  const bool full = static_cast<int>(features.size()) >= budget_;
  std::vector<std::uint8_t> wanted(static_cast<std::size_t>(parts_.size()));
  for (std::size_t part = 0; part < wanted.size(); ++part) {
    const auto cell = static_cast<std::size_t>(cell_of_part_[part]);
    wanted[part] = cell_due[cell] != 0 && (count[cell] == 0 || !full) ? 1 : 0;
  }
  for (const Eigen::Vector3d& feature : features) {
    wanted[static_cast<std::size_t>(parts_.CellOf(feature))] = 0;
  }
  return wanted;
}

std::vector<PanoramicObservation> FeatureBudget::Select(
    const PanoramaModel& model, std::span<const std::vector<Corner>> corners,
    std::span<const Eigen::Vector3d> features) const {
  std::vector<Candidate> candidates = LiftCorners(model, *this, corners);
  std::vector<Eigen::Vector3d> taken;
  for (const Eigen::Vector3d& feature : features) taken.push_back(feature.normalized());
  std::vector<int> count = CountPerCell(features);
  std::vector<PanoramicObservation> selected;
  for (int round = 0; round < kPartsPerCell; ++round) {
    const double distance = round == 0 ? min_distance() : min_distance_in_cell();
    for (Candidate& candidate : candidates) {
      if (round > 0 && static_cast<int>(taken.size()) >= budget_) return selected;
      int& in_cell = count[static_cast<std::size_t>(candidate.cell)];
      if (candidate.taken || in_cell > round) continue;
      if (Crowded(candidate.direction, taken, distance)) continue;
      candidate.taken = true;
      ++in_cell;
      taken.push_back(candidate.direction);
      selected.push_back(candidate.observation);
    }
  }
  return selected;
}

}  // namespace mlvi

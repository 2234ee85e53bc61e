// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/feature_budget.h"

#include <algorithm>
#include <cmath>
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

int CountRegions(const std::vector<RegionMap>& maps, int cells) {
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(cells));
  for (const RegionMap& map : maps) {
    for (int row = 0; row < map.rows(); ++row) {
      for (int column = 0; column < map.columns(); ++column) {
        if (const int cell = map.At(column, row); cell >= 0)
          seen[static_cast<std::size_t>(cell)] = 1;
      }
    }
  }
  return static_cast<int>(std::count(seen.begin(), seen.end(), 1));
}

}  // namespace

FeatureBudget::FeatureBudget(const PanoramaModel& model, int budget)
    : cells_(std::max(2, static_cast<int>(std::lround(budget / Coverage(model))))) {
  MLVI_CHECK(budget >= 1, "budget of {} features", budget);
  for (int camera = 0; camera < model.cameras(); ++camera) {
    regions_.push_back(MapRegions(model, camera, cells_));
  }
  visible_ = CountRegions(regions_, cells_.size());
}

std::vector<std::uint8_t> FeatureBudget::EmptyCells(
    std::span<const Eigen::Vector3d> features) const {
  std::vector<std::uint8_t> empty(static_cast<std::size_t>(cells_.size()), 1);
  for (const Eigen::Vector3d& feature : features) {
    empty[static_cast<std::size_t>(cells_.CellOf(feature))] = 0;
  }
  return empty;
}

std::vector<PanoramicObservation> FeatureBudget::Select(
    const PanoramaModel& model, std::span<const std::vector<Corner>> corners,
    std::span<const Eigen::Vector3d> features) const {
  struct Candidate {
    Corner corner;
    int camera = 0;
  };
  std::vector<Candidate> candidates;
  for (std::size_t camera = 0; camera < corners.size(); ++camera) {
    for (const Corner& corner : corners[camera]) {
      candidates.push_back({corner, static_cast<int>(camera)});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.corner.texture > b.corner.texture;
  });
  std::vector<Eigen::Vector3d> taken;
  for (const Eigen::Vector3d& feature : features) taken.push_back(feature.normalized());
  std::vector<std::uint8_t> free = EmptyCells(features);
  std::vector<PanoramicObservation> selected;
  const double nearest = std::cos(min_distance());
  for (const Candidate& candidate : candidates) {
    std::uint8_t& cell_free = free[static_cast<std::size_t>(candidate.corner.region)];
    if (cell_free == 0) continue;
    const auto observation = model.Lift(candidate.camera, candidate.corner.pixel);
    if (!observation) continue;
    const Eigen::Vector3d direction = observation->point.normalized();
    const bool crowded = std::any_of(taken.begin(), taken.end(), [&](const Eigen::Vector3d& other) {
      return other.dot(direction) > nearest;
    });
    if (crowded) continue;
    cell_free = 0;
    taken.push_back(direction);
    selected.push_back(*observation);
  }
  return selected;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

constexpr std::size_t kGrain = 4096;

// Where a point lies on the sphere.
struct Placed {
  Eigen::Vector3d point;  // pano
  double depth = 0.0;
  int cell = -1;  // -1: outside of the range of depths
};

std::vector<Placed> PlaceOnSphere(std::span<const Eigen::Vector3f> points_world,
                                  const Pose3& T_pano_world, const EqualAreaSphere& cells,
                                  const DepthConfig& config) {
  std::vector<Placed> placed(points_world.size());
  const Eigen::Matrix3d R = T_pano_world.R();
  ParallelFor(points_world.size(), kGrain, [&](std::size_t i) {
    Placed& p = placed[i];
    p.point = R * points_world[i].cast<double>() + T_pano_world.translation();
    p.depth = p.point.norm();
    if (p.depth >= config.min_depth && p.depth <= config.max_depth) p.cell = cells.CellOf(p.point);
  });
  return placed;
}

// Of every cell and of the end the number of occupied cells before it, from the nearest depth of
// every cell.
std::vector<int> CountOccupied(std::span<const float> nearest) {
  std::vector<int> first = {0};
  first.reserve(nearest.size() + 1);
  for (const float depth : nearest) first.push_back(first.back() + (std::isfinite(depth) ? 1 : 0));
  return first;
}

// A candidate for the nearest neighbours.
struct Candidate {
  double squared_chord = 0.0;
  int index = 0;
  bool operator<(const Candidate& other) const {
    return squared_chord < other.squared_chord ||
           (squared_chord == other.squared_chord && index < other.index);
  }
};

// The `k` nearest of the candidates so far, in order.
class NearestFew {
 public:
  explicit NearestFew(int k) : k_(k) {}
  void Offer(const Candidate& candidate) {
    if (count_ == k_ && !(candidate < best_[static_cast<std::size_t>(k_ - 1)])) return;
    auto place = best_.begin() + std::min(count_, k_ - 1);
    for (; place != best_.begin() && candidate < *(place - 1); --place) *place = *(place - 1);
    *place = candidate;
    count_ = std::min(count_ + 1, k_);
  }
  std::span<const Candidate> best() const {
    return {best_.data(), static_cast<std::size_t>(count_)};
  }

 private:
  int k_, count_ = 0;
  std::array<Candidate, SphericalDepthMap::Neighbors::kCapacity> best_;
};

}  // namespace

// A point of a cell is the mean of what lies at most `config.layer` behind its nearest one. The
// nearest alone would be the one with the most negative error.
SphericalDepthMap::SphericalDepthMap(std::span<const Eigen::Vector3f> points_world,
                                     const Pose3& T_world_pano, const DepthConfig& config)
    : cells_(EqualAreaSphere::WithCellAngle(config.cell_angle)) {
  const std::vector<Placed> placed =
      PlaceOnSphere(points_world, T_world_pano.inverse(), cells_, config);
  std::vector<float> nearest(static_cast<std::size_t>(cells_.size()),
                             std::numeric_limits<float>::infinity());
  for (const Placed& p : placed) {
    if (p.cell < 0) continue;
    float& depth = nearest[static_cast<std::size_t>(p.cell)];
    depth = std::min(depth, static_cast<float>(p.depth));
  }
  first_ = CountOccupied(nearest);
  points_.assign(static_cast<std::size_t>(first_.back()), Eigen::Vector3d::Zero());
  std::vector<int> counts(points_.size(), 0);
  for (const Placed& p : placed) {
    if (p.cell < 0) continue;
    const auto cell = static_cast<std::size_t>(p.cell);
    if (static_cast<float>(p.depth) > nearest[cell] + static_cast<float>(config.layer)) continue;
    points_[static_cast<std::size_t>(first_[cell])] += p.point;
    ++counts[static_cast<std::size_t>(first_[cell])];
  }
  directions_.reserve(points_.size());
  ranges_.reserve(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i] /= counts[i];
    ranges_.push_back(points_[i].norm());
    directions_.emplace_back(points_[i] / ranges_.back());
  }
}

SphericalDepthMap::Neighbors SphericalDepthMap::Nearest(const Eigen::Vector3d& direction, int k,
                                                        double max_angle) const {
  MLVI_CHECK(k >= 1 && k <= Neighbors::kCapacity, "{} neighbours of at most {}", k,
             Neighbors::kCapacity);
  // Where points are dense, few cells hold enough of them.
  double angle = cells_.cell_angle() * (1.0 + 0.5 * std::sqrt(k));
  while (angle < max_angle) {
    const Neighbors near = NearestWithin(direction, k, angle);
    if (near.count == k) return near;
    angle *= 2.0;
  }
  return NearestWithin(direction, k, max_angle);
}

template <typename Visit>
void SphericalDepthMap::ForEachWithin(const Eigen::Vector3d& direction, double angle,
                                      const Visit& visit) const {
  const double chord = 2.0 * std::sin(0.5 * std::min(angle, std::numbers::pi));
  const double limit = chord * chord;
  // A mean of points leaves its cell only where the bands bend, and by less than that.
  cells_.ForEachRun(direction, angle + 0.15 * cells_.cell_angle(), [&](int first, int end) {
    const int last = first_[static_cast<std::size_t>(end)];
    for (int i = first_[static_cast<std::size_t>(first)]; i < last; ++i) {
      const double squared = (directions_[static_cast<std::size_t>(i)] - direction).squaredNorm();
      if (squared <= limit) visit(i, squared);
    }
  });
}

SphericalDepthMap::Neighbors SphericalDepthMap::NearestWithin(const Eigen::Vector3d& direction,
                                                              int k, double angle) const {
  NearestFew few(k);
  ForEachWithin(direction, angle, [&](int index, double squared) { few.Offer({squared, index}); });
  Neighbors result;
  for (const Candidate& c : few.best()) {
    const auto n = static_cast<std::size_t>(result.count++);
    result.index[n] = c.index;
    result.angle[n] = 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(c.squared_chord)));
  }
  return result;
}

std::optional<double> SphericalDepthMap::NearestRange(const Eigen::Vector3d& direction,
                                                      double angle) const {
  double nearest = std::numeric_limits<double>::infinity();
  ForEachWithin(direction, angle, [&](int index, double /*squared*/) {
    nearest = std::min(nearest, ranges_[static_cast<std::size_t>(index)]);
  });
  return std::isfinite(nearest) ? std::optional(nearest) : std::nullopt;
}

}  // namespace mlvi

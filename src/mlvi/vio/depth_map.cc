// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_map.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/geometry/equal_area_sphere.h"

namespace mlvi {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr int kLeafSize = 12;

// What nanoflann asks of a set of points.
struct Directions {
  std::vector<Eigen::Vector3d> values;

  std::size_t kdtree_get_point_count() const { return values.size(); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return values[index][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Directions>,
                                                   Directions, 3, std::uint32_t>;

struct Candidate {
  int cell = -1;
  float depth = 0.0F;
  std::uint32_t index = 0;

  bool operator<(const Candidate& other) const {
    return std::tie(cell, depth, index) < std::tie(other.cell, other.depth, other.index);
  }
};

// The points within the range of depths, by cell, nearest first.
std::vector<Candidate> SortIntoCells(std::span<const Eigen::Vector3f> points_world,
                                     const Pose3& T_pano_world, const DepthConfig& config) {
  const EqualAreaSphere cells = EqualAreaSphere::WithCellAngle(config.cell_angle);
  std::vector<Candidate> candidates(points_world.size());
  const Eigen::Matrix3d R = T_pano_world.R();
  ParallelFor(points_world.size(), kGrain, [&](std::size_t i) {
    const Eigen::Vector3d p = R * points_world[i].cast<double>() + T_pano_world.translation();
    const double depth = p.norm();
    if (!(depth >= config.min_depth && depth <= config.max_depth)) return;
    candidates[i] = {cells.CellOf(p), static_cast<float>(depth), static_cast<std::uint32_t>(i)};
  });
  std::erase_if(candidates, [](const Candidate& c) { return c.cell < 0; });
  std::sort(candidates.begin(), candidates.end());
  return candidates;
}

}  // namespace

struct SphericalDepthMap::Tree {
  std::vector<Eigen::Vector3d> points;
  Directions directions;
  std::unique_ptr<KdTree> tree;
};

SphericalDepthMap::SphericalDepthMap(std::span<const Eigen::Vector3f> points_world,
                                     const Pose3& T_world_pano, const DepthConfig& config)
    : tree_(std::make_unique<Tree>()) {
  const Pose3 T_pano_world = T_world_pano.inverse();
  int last_cell = -1;
  for (const Candidate& candidate : SortIntoCells(points_world, T_pano_world, config)) {
    if (std::exchange(last_cell, candidate.cell) == candidate.cell) continue;
    const Eigen::Vector3d p = T_pano_world * points_world[candidate.index].cast<double>();
    tree_->points.push_back(p);
    tree_->directions.values.push_back(p.normalized());
  }
  tree_->tree = std::make_unique<KdTree>(3, tree_->directions,
                                         nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize));
  tree_->tree->buildIndex();
}

SphericalDepthMap::~SphericalDepthMap() = default;
SphericalDepthMap::SphericalDepthMap(SphericalDepthMap&&) noexcept = default;
SphericalDepthMap& SphericalDepthMap::operator=(SphericalDepthMap&&) noexcept = default;

const std::vector<Eigen::Vector3d>& SphericalDepthMap::points() const { return tree_->points; }

SphericalDepthMap::Neighbors SphericalDepthMap::Nearest(const Eigen::Vector3d& direction, int k,
                                                        double max_angle) const {
  MLVI_CHECK(k >= 1 && k <= Neighbors::kCapacity, "{} neighbours of at most {}", k,
             Neighbors::kCapacity);
  Neighbors result;
  std::array<std::uint32_t, Neighbors::kCapacity> indices;
  std::array<double, Neighbors::kCapacity> squared_chords;
  const std::size_t found = tree_->tree->knnSearch(direction.data(), static_cast<std::size_t>(k),
                                                   indices.data(), squared_chords.data());
  for (std::size_t i = 0; i < found; ++i) {
    const double angle = 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(squared_chords[i])));
    if (angle > max_angle) break;
    result.index[i] = static_cast<int>(indices[i]);
    result.angle[i] = angle;
    ++result.count;
  }
  return result;
}

}  // namespace mlvi

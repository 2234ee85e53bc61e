// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

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

// Where a point lies on the sphere.
struct Placed {
  Eigen::Vector3d point;  // pano
  int cell = -1;          // -1: outside of the range of depths
};

std::vector<Placed> PlaceOnSphere(std::span<const Eigen::Vector3f> points_world,
                                  const Pose3& T_pano_world, const EqualAreaSphere& cells,
                                  const DepthConfig& config) {
  std::vector<Placed> placed(points_world.size());
  const Eigen::Matrix3d R = T_pano_world.R();
  ParallelFor(points_world.size(), kGrain, [&](std::size_t i) {
    placed[i].point = R * points_world[i].cast<double>() + T_pano_world.translation();
    const double depth = placed[i].point.norm();
    if (depth >= config.min_depth && depth <= config.max_depth) {
      placed[i].cell = cells.CellOf(placed[i].point);
    }
  });
  return placed;
}

// Of every occupied cell the mean of what lies at most `config.layer` behind its nearest point, in
// the order of cells. The nearest alone would be the one with the most negative error.
std::vector<Eigen::Vector3d> NearestLayers(std::span<const Placed> placed, int cells,
                                           const DepthConfig& config) {
  std::vector<float> nearest(static_cast<std::size_t>(cells),
                             std::numeric_limits<float>::infinity());
  for (const Placed& p : placed) {
    if (p.cell < 0) continue;
    float& depth = nearest[static_cast<std::size_t>(p.cell)];
    depth = std::min(depth, static_cast<float>(p.point.norm()));
  }
  std::vector<int> slots(static_cast<std::size_t>(cells), -1);
  int occupied = 0;
  for (std::size_t cell = 0; cell < nearest.size(); ++cell) {
    if (std::isfinite(nearest[cell])) slots[cell] = occupied++;
  }
  std::vector<Eigen::Vector3d> sums(static_cast<std::size_t>(occupied), Eigen::Vector3d::Zero());
  std::vector<int> counts(static_cast<std::size_t>(occupied), 0);
  for (const Placed& p : placed) {
    if (p.cell < 0) continue;
    const auto cell = static_cast<std::size_t>(p.cell);
    if (p.point.norm() > static_cast<double>(nearest[cell]) + config.layer) continue;
    sums[static_cast<std::size_t>(slots[cell])] += p.point;
    ++counts[static_cast<std::size_t>(slots[cell])];
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= counts[i];
  return sums;
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
  const EqualAreaSphere cells = EqualAreaSphere::WithCellAngle(config.cell_angle);
  tree_->points = NearestLayers(PlaceOnSphere(points_world, T_world_pano.inverse(), cells, config),
                                cells.size(), config);
  for (const Eigen::Vector3d& p : tree_->points) {
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

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/geometry/equal_area_sphere.h"
#include "mlvi/geometry/pose3.h"
#include "mlvi/state/estimates.h"
#include "mlvi/vio/depth_config.h"

namespace mlvi {

// LiDAR points on the panoramic sphere at one instant: of every fine cell the mean of the nearest
// ones, as what lies behind is hidden. The cells are the index, too: what is near a direction lies
// in a few runs of them.
class SphericalDepthMap {
 public:
  // `T_world_pano`: place of the sphere.
  SphericalDepthMap(std::span<const Eigen::Vector3f> points_world, const Pose3& T_world_pano,
                    const DepthConfig& config);

  struct Neighbors {
    static constexpr int kCapacity = 32;
    std::array<int, kCapacity> index;     // into points(), nearest first
    std::array<double, kCapacity> angle;  // rad, to the direction asked for
    int count = 0;
  };
  // The `k` <= kCapacity points nearest to a unit direction (pano), within `max_angle` (rad).
  Neighbors Nearest(const Eigen::Vector3d& direction, int k, double max_angle) const;

  // The smallest range (m, from S) of the points within `angle` (rad) of a unit direction.
  std::optional<double> NearestRange(const Eigen::Vector3d& direction, double angle) const;

  // Pano frame, m. One per occupied cell, in the order of cells.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  // Calls visit(index of point, squared chord to `direction`) for all points within `angle`.
  template <typename Visit>
  void ForEachWithin(const Eigen::Vector3d& direction, double angle, const Visit& visit) const;
  Neighbors NearestWithin(const Eigen::Vector3d& direction, int k, double angle) const;

  EqualAreaSphere cells_;
  std::vector<int> first_;  // of every cell and of the end: points in the cells before it
  std::vector<Eigen::Vector3d> points_, directions_;
  std::vector<double> ranges_;
};

}  // namespace mlvi

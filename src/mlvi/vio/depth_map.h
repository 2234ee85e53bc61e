// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "mlvi/geometry/pose3.h"
#include "mlvi/state/estimates.h"
#include "mlvi/vio/depth_config.h"

namespace mlvi {

// LiDAR points on the panoramic sphere at one instant: of every fine cell the mean of the nearest
// ones, as what lies behind is hidden, in a k-d tree over unit directions. Two-dimensional in content; three
// coordinates per direction have no seam.
class SphericalDepthMap {
 public:
  // `T_world_pano`: place of the sphere.
  SphericalDepthMap(std::span<const Eigen::Vector3f> points_world, const Pose3& T_world_pano,
                    const DepthConfig& config);
  ~SphericalDepthMap();
  SphericalDepthMap(SphericalDepthMap&&) noexcept;
  SphericalDepthMap& operator=(SphericalDepthMap&&) noexcept;

  struct Neighbors {
    static constexpr int kCapacity = 32;
    std::array<int, kCapacity> index;     // into points(), nearest first
    std::array<double, kCapacity> angle;  // rad, to the direction asked for
    int count = 0;
  };
  // The `k` <= kCapacity points nearest to a unit direction (pano), within `max_angle` (rad).
  Neighbors Nearest(const Eigen::Vector3d& direction, int k, double max_angle) const;

  // Pano frame, m. One per occupied cell, in the order of cells.
  const std::vector<Eigen::Vector3d>& points() const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace mlvi

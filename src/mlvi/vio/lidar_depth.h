// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "mlvi/state/estimates.h"
#include "mlvi/vio/depth_accumulator.h"
#include "mlvi/vio/depth_map.h"
#include "mlvi/vio/window.h"

namespace mlvi {

// Gives features of the window the depth that LiDAR has seen. Sweeps are accumulated in the world
// of the LiDAR odometry, which drifts apart from that of the window; the newest sweep that lies
// within the window's time tells how the two are placed.
class LidarDepth {
 public:
  explicit LidarDepth(const DepthConfig& config) : config_(config), accumulator_(config) {}

  // A deskewed sweep in the body frame at `stamp`, and where the LiDAR odometry has that body.
  // Stamps must not fall.
  void Add(std::span<const Eigen::Vector3f> points_body, const Pose3& T_lidar_body, Time stamp);
  // The LiDAR odometry has begun anew: what it says now is not placed with what it said.
  void Clear();
  bool empty() const { return accumulator_.points().empty(); }

  // Measures features without a depth by LiDAR at their observation in the newest frame. Returns
  // how many got one.
  int Associate(VioWindow& window, const WindowConfig& config);

 private:
  // Of the LiDAR odometry's world in that of the window.
  std::optional<Pose3> FindPlacement(const VioWindow& window) const;

  struct Sweep {
    Time stamp;
    Pose3 T_lidar_body;
  };

  DepthConfig config_;
  DepthAccumulator accumulator_;
  std::deque<Sweep> sweeps_;  // of config.span
};

}  // namespace mlvi

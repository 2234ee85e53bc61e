// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/lio/local_map.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// One scalar constraint: normal . (T_world_body point - anchor) = 0 with the given variance. A
// point on a line gives two of them.
struct Correspondence {
  Eigen::Vector3d point;   // body frame
  Eigen::Vector3d anchor;  // world frame
  Eigen::Vector3d normal;  // world frame, unit
  double variance = 0.0;   // m^2: range and beam noise of the point, noise of the fit at the point
  double gate =
      0.0;  // m^2: what the uncertainty of the pose adds to the variance when outliers are told
  float lag = 0.0F;  // share of the sweep's span between this firing and the last one
  // Standard deviations (rad) of the normal towards two perpendicular directions, along those;
  // world frame.
  Eigen::Vector3d tilt_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d tilt_b = Eigen::Vector3d::Zero();
};

// From where a sweep was seen, as far as is known, and how well points are measured.
struct Viewpoint {
  Pose3 T_world_body;
  Matrix6d pose_covariance;  // world position, body rotation: gates outliers and widens the search
  Eigen::Vector3d p_body_lidar;  // where beams start
  double range_noise = 0.02;     // m
  double beam_noise = 0.001;     // rad
};

// Fits planes and lines of the map to the features of a sweep, each at its place by
// `view.T_world_body`.
std::vector<Correspondence> Associate(const SweepFeatures& features, const LocalMap& map,
                                      const Viewpoint& view, const RegistrationConfig& config);

// Ties the marks of a sweep to those of the map. Each constrains the place along `axis` only.
std::vector<Correspondence> AssociateMarks(const SweepFeatures& features, const LocalMap& map,
                                           const Viewpoint& view, const Eigen::Vector3d& axis,
                                           const RegistrationConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The freedom that gravity leaves, and how the first states fix it: heading zero for the first
// body.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace mlvi {

// One sigma with which position and heading of the first body are held: nothing against any sensor,
// and enough to keep covariances regular.
inline constexpr double kGaugePositionSigma = 1e-3;  // m
inline constexpr double kGaugeHeadingSigma = 1e-4;   // rad

// Heading of a body: azimuth of its x axis in the world; where that stands close to upright, of its
// y axis (less 90 degrees, so that an upright body has heading zero at identity).
class Heading {
 public:
  // Chooses the axis for a body that sees up in direction `up_body` (any length but zero).
  explicit Heading(const Eigen::Vector3d& up_body)
      : axis_(std::abs(up_body.x()) < 0.9 * up_body.norm() ? 0 : 1) {}

  // In (-pi, pi].
  double Of(const Eigen::Matrix3d& R_world_body) const;
  // By a right perturbation of the rotation.
  Eigen::RowVector3d Derivative(const Eigen::Matrix3d& R_world_body) const;

 private:
  int axis_;
};

// R_world_body of heading zero for a body that sees up in direction `up_body` (any length but
// zero).
Eigen::Quaterniond LevelRotation(const Eigen::Vector3d& up_body);

}  // namespace mlvi

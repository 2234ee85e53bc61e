// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

struct ImuBias {
  Eigen::Vector3d accelerometer = Eigen::Vector3d::Zero();  // m/s^2
  Eigen::Vector3d gyroscope = Eigen::Vector3d::Zero();      // rad/s
};

using Vector15d = Eigen::Matrix<double, 15, 1>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

// The state of the body at one instant. World: gravity-aligned, z up, gravity (0, 0, -g).
struct NavState {
  Time stamp;
  Pose3 T_world_body;
  Eigen::Vector3d v_world_body = Eigen::Vector3d::Zero();  // m/s
  ImuBias bias;
};

// Error-state order of covariances: position, velocity, rotation, accelerometer bias, gyroscope
// bias.
namespace nav_index {
inline constexpr int kPosition = 0, kVelocity = 3, kRotation = 6, kAccelerometerBias = 9,
                     kGyroscopeBias = 12;
}

// Position and velocity errors add in the world frame; rotation is a right perturbation (body
// frame).
NavState BoxPlus(const NavState& state, const Vector15d& delta);
Vector15d BoxMinus(const NavState& a, const NavState& b);

// The pose's part of a covariance in error-state order, in the pose chart (BoxMinus of poses:
// position error in the body frame, then rotation); `R_world_body` is the attitude that it belongs
// to.
Matrix6d PoseChartCovariance(const Eigen::Matrix3d& R_world_body, const Matrix15d& covariance);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Closed form of the moving start: what gravity, velocities and biases reconcile poses with
// preintegrated IMU motion (after Qin and Shen, "Robust Initialization of Monocular Visual-Inertial
// Estimation", 2017, without the scale).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/imu/initialization.h"
#include "mlvi/imu/preintegration.h"

namespace mlvi::internal {

// All vectors in the fixed frame of the poses.
struct PoseAlignment {
  Eigen::Vector3d gravity =
      Eigen::Vector3d::Zero();              // m/s^2, of the given magnitude, pointing down
  std::vector<Eigen::Vector3d> velocities;  // m/s, one per pose
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
};

// The gyroscope bias that turns the preintegrated rotations into those between the poses: linear
// least squares with the prior of `imu`. `motions[k]` leads from pose k to pose k + 1.
Eigen::Vector3d AlignGyroscopeBias(std::span<const TimedPose> poses,
                                   std::span<const PreintegratedImu> motions, const ImuSpec& imu);

// Gravity, velocities and accelerometer bias: linear least squares under the constraint |gravity| =
// `gravity`.
PoseAlignment AlignGravity(std::span<const TimedPose> poses,
                           std::span<const PreintegratedImu> motions, const ImuSpec& imu,
                           double gravity);

}  // namespace mlvi::internal

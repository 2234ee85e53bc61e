// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The one integration step of the module, between two neighbouring IMU samples: preintegration and
// propagation both consist of it, so they agree to rounding.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi::internal {

// Rotation and specific force are taken constant in the body frame over the interval, at the mean
// of both samples, and integrated exactly: with phi = w dt,
//   rotation = Exp(phi),  velocity = dt F_1(phi) a,  position = dt^2 F_2(phi) a,
//   F_m(phi) = sum_n Hat(phi)^n / (n + m)!.
// A plain midpoint rule is this one with F_m cut after the linear term.
struct ImuStep {
  double dt = 0.0;                     // s
  Eigen::Quaterniond rotation;         // of the body at the end in the body at the start
  Eigen::Vector3d velocity, position;  // of the specific force alone, body at the start
  // Derivatives by the mean rate and the mean specific force; that of the rotation is a right
  // perturbation.
  Eigen::Matrix3d rotation_by_rate;
  Eigen::Matrix3d velocity_by_rate, velocity_by_force;
  Eigen::Matrix3d position_by_rate, position_by_force;
  // Variances of the mean rate and the mean specific force over the interval, per axis.
  Eigen::Vector3d rate_variance, force_variance;
};

// From `first` to the later `second`. A saturated axis and a gap of more than 1.5 periods of `imu`
// between the measurements around the interval raise the variances (see the .cc for the models).
ImuStep IntegrateStep(const ImuSample& first, const ImuSample& second, const ImuBias& bias,
                      const ImuSpec& imu);

// Error-state transition over the step for a body at rotation R (to the frame in which position and
// velocity live). Errors are truth minus estimate in the order p, v, R, ba, bg.
Matrix15d StepTransition(const Eigen::Matrix3d& R, const ImuStep& step);

// Covariance that the step adds.
Matrix15d StepNoise(const Eigen::Matrix3d& R, const ImuStep& step, const ImuNoise& noise);

}  // namespace mlvi::internal

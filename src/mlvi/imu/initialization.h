// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// First states: from rest (gravity alignment, gyroscope bias), and from motion once relative poses
// exist.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

struct Initialization {
  // States in the gravity-aligned world whose origin is the first body position and whose x axis is
  // the azimuth of the first body's x axis (of its y axis less 90 degrees, if x stands within 26
  // degrees of upright).
  std::vector<NavState> states;
  Matrix15d covariance;  // of the last state
  // Of the moving start: for every state k, of its pose as seen from the last one, T_last_k (pose
  // chart; zero for the last). Else empty.
  std::vector<Matrix6d> relative;
  std::string method;         // "static" or "moving", for the report
  double rms_residual = 0.0;  // whitened (root of the reduced chi square), of the moving start
};

// From at least 0.5 s at rest; the states are those at the first and the last sample. Attitude from
// the direction of the mean acceleration, gyroscope bias from the mean rate, accelerometer bias
// zero with its prior. Empty when the samples show motion (the reason in `why`, if given) or are
// too few. A steady drive without vibration looks like rest to an IMU.
std::optional<Initialization> InitializeAtRest(std::span<const ImuSample> samples,
                                               const ImuSpec& imu, double gravity,
                                               std::string* why = nullptr);

// A body pose from another odometry, in an arbitrary fixed frame.
struct TimedPose {
  Time stamp;
  Pose3 T_start_body;
  // Of the step from the previous pose, in the pose chart (BoxMinus), positive definite; that of
  // the first pose is not used. Variances below (5 mm)^2 and (1 mrad)^2 are raised to these: no
  // sweep taken in motion registers better.
  Matrix6d covariance;
};

// From motion: gravity direction, velocities and biases that make the IMU agree with at least four
// poses over at least one second (closed form for gravity and velocities, then nonlinear refinement
// of everything with the prior on the biases of `imu`). Errors: too few poses, samples that do not
// cover them, or a residual that shows the poses and the IMU to contradict each other (wrong
// extrinsics, wrong time offset). Poses must be in strictly ascending order. The covariance grows
// with the residual where that is above one, and holds the first position to 1 mm and heading to
// 0.1 mrad.
Expected<Initialization> InitializeFromPoses(std::span<const TimedPose> poses,
                                             std::span<const ImuSample> samples, const ImuSpec& imu,
                                             double gravity);

}  // namespace mlvi

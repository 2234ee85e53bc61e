// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// The trajectory of the body through a run of IMU samples.
struct Propagation {
  std::vector<NavState> states;  // one per sample, the first equal to the start
  Matrix15d covariance;          // of the last state
  Matrix15d transition;          // d(last error) / d(first error)
};

// Integrates `start` (valid at samples.front().stamp) through all samples, rate and force constant
// between neighbours, on the manifold, and its error-state covariance beside it. `gravity` in
// m/s^2, magnitude.
Propagation Propagate(const NavState& start, const Matrix15d& covariance,
                      std::span<const ImuSample> samples, const ImuSpec& imu, double gravity);

// Pose at `stamp` between the two neighbouring states (rotation along the geodesic, position cubic
// by the velocities); clamped to the first or last state outside. `states` in ascending order, not
// empty.
Pose3 InterpolatePose(std::span<const NavState> states, Time stamp);

}  // namespace mlvi

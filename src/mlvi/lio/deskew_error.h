// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A sweep is deskewed by a motion that is not known exactly, which bends it: its parts ask for
// different poses, and what a registration finds is their mean, weighted by what each part tells.
#pragma once

#include <algorithm>
#include <array>

#include "mlvi/lio/filter_state.h"

namespace mlvi {

// What is not known of the motion within a sweep, given the pose at its end.
struct DeskewError {
  double span = 0.0;                                            // s
  Eigen::Matrix3d velocity = Eigen::Matrix3d::Zero();           // covariance, world, m^2/s^2
  Eigen::Matrix3d gyroscope_bias = Eigen::Matrix3d::Zero();     // covariance, rad^2/s^2
  double accelerometer_density = 0.0, gyroscope_density = 0.0;  // white noise (ImuNoise)
};
DeskewError DeskewErrorOf(const StateEstimate& at_end, Duration span, const ImuNoise& noise);

// The information that equal parts of the sweep's span give, the newest first.
constexpr std::size_t kSweepParts = 8;
struct SweepParts : std::array<Matrix6d, kSweepParts> {
  SweepParts() { fill(Matrix6d::Zero()); }
};
// `lag` is the share of the span between a firing and the last one, in [0, 1].
inline std::size_t PartOfSweep(float lag) {
  return std::min(static_cast<std::size_t>(lag * kSweepParts), kSweepParts - 1);
}

// Covariance (world position, body rotation) of the error of a pose that parts of the sweep tell by
// `information`. A part with mean lag u is displaced by u times velocity and gyroscope bias, and by
// white noise integrated over u: covariances s^2 min(u, v) of the gyroscopes' once and
// s^2 m^2 (3 M - m) / 6, m = min(u, v), M = max(u, v), of the accelerometers' twice. With B_k the
// pose that part k alone moves it by, the pose found is off by the sum of B_k times that:
//   B_k = A^-1 A_k,  A = sum A_k.
// So the turn of a part comes in as a shift, too, where its points are far away.
Matrix6d DeskewCovariance(const DeskewError& error, const SweepParts& information);

}  // namespace mlvi

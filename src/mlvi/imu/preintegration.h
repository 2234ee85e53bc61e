// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// On-manifold IMU preintegration (Forster et al., "On-Manifold Preintegration for Real-Time
// Visual-Inertial Odometry", 2017) with bias Jacobians and covariance.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// Motion between two instants as the IMU alone saw it, in the body frame of the first:
//   R_j = R_i delta_R,  v_j = v_i + g dt + R_i delta_v,  p_j = p_i + v_i dt + g dt^2 / 2 + R_i
//   delta_p.
struct PreintegratedImu {
  Time from;
  Time to;
  ImuBias bias;  // linearisation point of the biases
  Eigen::Quaterniond delta_R = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_v = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d delta_p = Eigen::Vector3d::Zero();  // m
  // Covariance of [delta_p, delta_v, delta_R (right perturbation), b_a, b_g] at `to`; the bias
  // blocks are the random walk accumulated from `from` to `to`.
  Matrix15d covariance = Matrix15d::Zero();
  // First-order change with the biases: delta_R(b) = delta_R Exp(dR_dbg (b_g - bias.gyroscope)) and
  // so on.
  Eigen::Matrix3d dR_dbg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dba = Eigen::Matrix3d::Zero(), dv_dbg = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dba = Eigen::Matrix3d::Zero(), dp_dbg = Eigen::Matrix3d::Zero();
  int samples = 0;

  double dt() const { return (to - from).seconds(); }
};

// The samples of [from, to], linearly interpolated at both ends and marked so (ImuSample::
// interpolated_over). `samples` must be in strictly
// ascending order. Where they do not reach an end, the nearest sample is held there. Empty when
// `samples` is empty or to <= from.
std::vector<ImuSample> SamplesBetween(std::span<const ImuSample> samples, Time from, Time to);

// Integrates samples[0].stamp .. samples.back().stamp. Samples beyond the saturation of `imu` and
// intervals much longer than its period enter with accordingly inflated noise.
PreintegratedImu Preintegrate(std::span<const ImuSample> samples, const ImuBias& bias,
                              const ImuSpec& imu);

// delta_R, delta_v, delta_p corrected to first order for another bias.
PreintegratedImu CorrectedForBias(const PreintegratedImu& preintegrated, const ImuBias& bias);

// The state at `to` that follows from the state at `from` (mean only). `gravity` in m/s^2,
// magnitude.
NavState Predict(const NavState& from, const PreintegratedImu& preintegrated, double gravity);

}  // namespace mlvi

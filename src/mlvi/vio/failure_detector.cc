// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/failure_detector.h"

#include <fmt/format.h>

namespace mlvi {

void FailureConfig::Declare(ConfigDeclaration& d) {
  d.Field("min_features", min_features, "", "Fewer features in the window tell no motion",
          {3.0, 1000.0});
  d.Field("patience", patience, "s", "How long too few features or contradictions are tolerated",
          {0.0, 60.0});
  d.Field("max_bias_sigmas", max_bias_sigmas, "",
          "Largest bias, in initial sigmas of the rig's IMU", {1.0, 1000.0});
  d.Field("max_jump", max_jump, "m",
          "Largest difference between the IMU's prediction over one set of images and the estimate",
          {0.001, 100.0});
  d.Field("max_rotation_jump", max_rotation_jump, "rad", "The same, of the attitude", {0.001, 3.2});
  d.Field("max_imu_chi_square", max_imu_chi_square, "",
          "Largest squared residual of the newest IMU factor (15 expected)", {15.0, 1e9});
  d.Field("max_position_sigma", max_position_sigma, "m", "Largest uncertainty of the position",
          {0.01, 1e6});
}

void FailureDetector::Reset() { last_good_ = Time(); }

std::string FailureDetector::Check(const WindowEstimate& estimate, const NavState& predicted) {
  std::string reason = CheckNow(estimate, predicted);
  return reason.empty() ? CheckForLong(estimate) : reason;
}

std::string FailureDetector::CheckNow(const WindowEstimate& estimate,
                                      const NavState& predicted) const {
  const NavState& state = estimate.newest.state;
  if (!estimate.solved || !BoxMinus(state, NavState()).allFinite()) {
    return fmt::format(
        "the window of {} features cannot be solved: too little is seen, or the "
        "calibration contradicts the images",
        estimate.features);
  }
  const double accelerometer = state.bias.accelerometer.norm();
  const double gyroscope = state.bias.gyroscope.norm();
  if (accelerometer > config_.max_bias_sigmas * imu_.initial_accelerometer_bias_sigma ||
      gyroscope > config_.max_bias_sigmas * imu_.initial_gyroscope_bias_sigma) {
    return fmt::format(
        "biases of {:.2f} m/s^2 and {:.4f} rad/s, above {:.0f} times the initial sigmas of {:.2f} "
        "and {:.4f}: wrong extrinsics, wrong time offset, or sigmas too small in the rig file",
        accelerometer, gyroscope, config_.max_bias_sigmas, imu_.initial_accelerometer_bias_sigma,
        imu_.initial_gyroscope_bias_sigma);
  }
  const Vector6d jump = BoxMinus(state.T_world_body, predicted.T_world_body);
  if (jump.head<3>().norm() > config_.max_jump ||
      jump.tail<3>().norm() > config_.max_rotation_jump) {
    return fmt::format(
        "the estimate is {:.2f} m and {:.3f} rad from what the IMU predicts for it: mismatched "
        "images or IMU samples lost",
        jump.head<3>().norm(), jump.tail<3>().norm());
  }
  const double sigma = std::sqrt(estimate.newest.covariance.topLeftCorner<3, 3>().trace());
  if (!(sigma <= config_.max_position_sigma)) {
    return fmt::format("the position is known to {:.1f} m only", sigma);
  }
  return {};
}

std::string FailureDetector::CheckForLong(const WindowEstimate& estimate) {
  const Time now = estimate.newest.state.stamp;
  const bool few = estimate.features < config_.min_features;
  const bool contradicts = !(estimate.imu_chi_square <= config_.max_imu_chi_square);
  if (!last_good_.valid() || !(few || contradicts)) {
    last_good_ = now;
    return {};
  }
  const double seconds = (now - last_good_).seconds();
  if (seconds <= config_.patience) return {};
  if (few) {
    return fmt::format(
        "{} features for {:.2f} s, below {}: darkness, blur, covered cameras, or "
        "walls without texture",
        estimate.features, seconds, config_.min_features);
  }
  return fmt::format(
      "images and IMU contradict each other (chi square {:.0f} of 15) for {:.2f} s: "
      "wrong time offset, saturated IMU, or a moving scene",
      estimate.imu_chi_square, seconds);
}

}  // namespace mlvi

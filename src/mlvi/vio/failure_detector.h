// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/vio/sliding_window.h"

namespace mlvi {

struct FailureConfig {
  int min_features = 12;
  double patience = 0.5;
  double max_bias_sigmas = 10.0;
  double max_jump = 0.5;
  double max_rotation_jump = 0.2;
  double max_imu_chi_square = 1000.0;
  double max_position_sigma = 50.0;
  void Declare(ConfigDeclaration& d);
};

// Tells when the window's estimate is not to be believed any more, and why: numbers, likely cause,
// remedy.
class FailureDetector {
 public:
  FailureDetector(const FailureConfig& config, const ImuSpec& imu) : config_(config), imu_(imu) {}

  void Reset();
  // Why the estimate fails; empty when it does not. `predicted`: the newest state by the IMU alone.
  // What may pass (few features, contradiction with the IMU) fails after config.patience.
  std::string Check(const WindowEstimate& estimate, const NavState& predicted);

 private:
  std::string CheckNow(const WindowEstimate& estimate, const NavState& predicted) const;
  std::string CheckForLong(const WindowEstimate& estimate);

  FailureConfig config_;
  ImuSpec imu_;
  Time last_good_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the LiDAR is mounted as the rig says, judged by what a wrong mount does to the estimate.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/lio/lio.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

struct MountLimits {
  double bias_sigmas = 5.0;    // of the rig's initial sigmas, per axis
  double misalignment = 0.03;  // rad
  double new_share = 0.15;     // mean share of points that are new to the map
  double residual = 1.5;       // rms of registrations, in range noises of the rig
};

class MountWatch {
 public:
  MountWatch(const Rig& rig, const MountLimits& limits);

  // Takes note of what became of a sweep. `imu`: the samples since the sweep before.
  void Observe(const LioResult& result, std::span<const ImuSample> imu);
  // What contradicts the mount, with numbers, likely causes and remedy; empty when nothing does, or
  // when there was too little motion to tell.
  std::vector<std::string> Findings() const;

 private:
  // The turn from the gyroscopes' axes to the LiDAR's as the rig places them: zero when right.
  struct Misalignment {
    double angle = 0.0;  // rad
    double sigma = 0.0;  // rad, about the axis that is known worst
  };

  std::optional<Misalignment> MeasuredMisalignment() const;
  std::string BiasFinding() const;
  std::string RegistrationFinding() const;

  ImuSpec imu_;
  double range_noise_;
  MountLimits limits_;
  std::optional<NavState> newest_;
  std::int64_t turns_ = 0, registrations_ = 0;
  // Sums over the steps of rotation vectors l (LiDAR odometry) and g (gyroscopes), rad^2.
  Eigen::Matrix3d sum_lg_ = Eigen::Matrix3d::Zero();
  double sum_ll_ = 0.0, sum_gg_ = 0.0;
  double sum_new_ = 0.0, sum_residual_ = 0.0;  // residuals: squares, m^2
};

}  // namespace mlvi

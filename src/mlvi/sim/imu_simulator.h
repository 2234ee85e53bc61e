// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/imu_errors.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

struct ImuPhysics {
  double rate_hz = 200.0;
  ImuNoise noise = {};
  double accelerometer_saturation = 150.0;  // m/s^2 per axis
  double gyroscope_saturation = 30.0;       // rad/s per axis
  double initial_accelerometer_bias = 0.1;  // m/s^2, largest per axis
  double initial_gyroscope_bias = 0.006;    // rad/s
  double gravity = 9.81;                    // m/s^2
  ImuErrors errors = {};
};

// Samples of a real IMU, and its biases at some instants as far as they are known.
struct RecordedImu {
  std::vector<ImuSample> samples;
  std::vector<std::pair<Time, ImuBias>> biases;
};

// The IMU of a body in motion: angular velocity and specific force R^T (a - g) from the exact
// derivatives of the spline and vibration, both multiplied by the sensitivity; biases that walk at
// random and settle; white noise of density / sqrt(dt); saturation. It integrates nothing.
class ImuSimulator {
 public:
  // Samples at begin, begin + 1/rate, ... within [begin, end]; `motion` must cover that.
  ImuSimulator(const ImuPhysics& physics, const PoseSpline& motion, Time begin, Time end,
               const RandomStream& random);

  // Real samples, their stamps and those of the biases moved by `shift`, within [begin, end];
  // nothing is added but saturation.
  ImuSimulator(const ImuPhysics& physics, const RecordedImu& recorded, Duration shift, Time begin,
               Time end);

  std::size_t size() const { return recorded_.empty() ? biases_.size() : recorded_.size(); }
  Time StampOf(std::size_t index) const;
  ImuSample Sample(std::size_t index) const;
  // The true bias of the last sample at or before `time`, or of the first one. Of recorded samples:
  // the last known one, or zero where none is.
  ImuBias BiasAt(Time time) const;
  // What specific force and angular velocity are multiplied by; identity of recorded samples.
  const Eigen::Matrix3d& accelerometer_sensitivity() const { return accelerometer_sensitivity_; }
  const Eigen::Matrix3d& gyroscope_sensitivity() const { return gyroscope_sensitivity_; }

 private:
  void DrawBiases(Time end, const RandomStream& random);
  ImuSample Saturate(ImuSample sample) const;

  ImuPhysics physics_;
  const PoseSpline* motion_ = nullptr;  // of the owner, who outlives this
  Time begin_;
  RandomStream noise_;
  Eigen::Matrix3d accelerometer_sensitivity_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d gyroscope_sensitivity_ = Eigen::Matrix3d::Identity();
  std::vector<ImuBias> biases_;      // one per simulated sample
  std::vector<Vector6d> vibration_;  // likewise, or empty
  std::vector<ImuSample> recorded_;
  std::vector<std::pair<Time, ImuBias>> recorded_biases_;
};

}  // namespace mlvi

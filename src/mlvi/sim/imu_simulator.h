// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
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
};

// Samples of a real IMU, and its biases at some instants as far as they are known.
struct RecordedImu {
  std::vector<ImuSample> samples;
  std::vector<std::pair<Time, ImuBias>> biases;
};

// The IMU of a body in motion: angular velocity and specific force R^T (a - g) from the exact
// derivatives of the spline, white noise of density / sqrt(dt), biases that walk at random,
// saturation. It integrates nothing.
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

 private:
  ImuSample Saturate(ImuSample sample) const;

  ImuPhysics physics_;
  const PoseSpline* motion_ = nullptr;  // of the owner, who outlives this
  Time begin_;
  RandomStream noise_;
  std::vector<ImuBias> biases_;  // one per simulated sample
  std::vector<ImuSample> recorded_;
  std::vector<std::pair<Time, ImuBias>> recorded_biases_;
};

}  // namespace mlvi

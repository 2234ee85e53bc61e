// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether an IMU delivers what an IMU must: specific force with gravity in it, and values that
// live.
#pragma once

#include <cstdint>
#include <vector>

#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/health.h"

namespace mlvi {

class ImuWatch {
 public:
  ImuWatch(const ImuSpec& spec, double gravity) : spec_(spec), gravity_(gravity) {}

  // Takes note of a sample, in order of time.
  void Observe(const ImuSample& sample);
  // All that is wrong so far, by level and with its reason; empty when nothing is. kFailed: no
  // estimate can be built on these samples.
  std::vector<Health> Findings() const;

 private:
  // Three channels that belong together.
  struct Triad {
    Eigen::Vector3d newest = Eigen::Vector3d::Constant(-1e9);
    std::int64_t repeated = 0;
  };

  void AddForce(std::vector<Health>& findings) const;
  void AddFrozen(const Triad& triad, const char* name, std::vector<Health>& findings) const;

  ImuSpec spec_;
  double gravity_;  // m/s^2
  Triad accelerometer_, gyroscope_;
  double force_sum_ = 0.0;  // of the norms, m/s^2
  std::int64_t samples_ = 0, saturated_ = 0;
  Time first_, newest_;
};

}  // namespace mlvi

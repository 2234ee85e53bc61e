// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

inline constexpr double kStandardGravity = 9.80665;  // m/s^2 in one g

// The median norm of the accelerations; 0 when there is none.
double MedianAcceleration(const std::vector<ImuSample>& samples);
// m/s^2 or g, whichever puts the median norm nearer to gravity (on a logarithmic scale: the border
// is 3.13).
AccelerationUnit DetectAccelerationUnit(double median_norm);

// Brings IMU samples to SI units and the rig's clock, and sorts out bad ones.
class ImuNormalizer {
 public:
  // `first` are samples of about the first second, in the units of the recording: they decide the
  // unit when the rig leaves it open.
  ImuNormalizer(const ImuSpec& spec, const std::vector<ImuSample>& first);

  enum class Fate { kDelivered, kNotFinite, kDuplicate };
  // Changes `sample` to SI units and the rig's clock.
  Fate Normalize(ImuSample& sample);

  double acceleration_scale() const { return scale_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  Duration time_offset_;
  double scale_ = 1.0;
  Time last_;
  std::vector<std::string> notes_;
};

}  // namespace mlvi

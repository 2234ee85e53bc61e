// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/imu_normalizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mlvi {

double MedianAcceleration(const std::vector<ImuSample>& samples) {
  std::vector<double> norms;
  for (const ImuSample& sample : samples) {
    if (sample.linear_acceleration.allFinite()) norms.push_back(sample.linear_acceleration.norm());
  }
  if (norms.empty()) return 0.0;
  const auto middle = norms.begin() + static_cast<std::ptrdiff_t>(norms.size() / 2);
  std::nth_element(norms.begin(), middle, norms.end());
  return *middle;
}

AccelerationUnit DetectAccelerationUnit(double median_norm) {
  // The geometric mean of 1 and 9.80665.
  constexpr double kBorder = 3.1316;
  return median_norm > 0.0 && median_norm < kBorder ? AccelerationUnit::kGravities
                                                    : AccelerationUnit::kMetresPerSecondSquared;
}

ImuNormalizer::ImuNormalizer(const ImuSpec& spec, const std::vector<ImuSample>& first)
    : time_offset_(spec.time_offset) {
  const double median = MedianAcceleration(first);
  const bool automatic = spec.acceleration_unit == AccelerationUnit::kAuto;
  const AccelerationUnit unit = automatic ? DetectAccelerationUnit(median) : spec.acceleration_unit;
  if (unit == AccelerationUnit::kGravities) scale_ = kStandardGravity;
  if (unit == AccelerationUnit::kGravities && automatic) {
    notes_.push_back(fmt::format(
        "imu: the median acceleration of the first second is {:.3f}: taken as g and converted "
        "to m/s^2 (imu.acceleration_unit says otherwise if need be)",
        median));
  }
  const double in_si = median * scale_;
  if (!first.empty() && median == 0.0) {
    notes_.push_back(fmt::format(
        "imu: the {} samples of the first second hold no acceleration: all are zero, NaN or "
        "infinite",
        first.size()));
  } else if (!first.empty() && (in_si < 6.0 || in_si > 16.0)) {
    notes_.push_back(fmt::format(
        "imu: the median acceleration of the first second is {:.3f} m/s^2, far from gravity: is it "
        "specific force, is imu.acceleration_unit right?",
        in_si));
  }
}

ImuNormalizer::Fate ImuNormalizer::Normalize(ImuSample& sample) {
  if (!sample.angular_velocity.allFinite() || !sample.linear_acceleration.allFinite())
    return Fate::kNotFinite;
  sample.linear_acceleration *= scale_;
  sample.stamp = sample.stamp + time_offset_;
  if (sample.stamp == last_) return Fate::kDuplicate;
  last_ = sample.stamp;
  return Fate::kDelivered;
}

}  // namespace mlvi

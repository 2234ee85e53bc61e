// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/imu_watch.h"

#include <fmt/format.h>

namespace mlvi {
namespace {

// The mean specific force over a time T is gravity but for the change of velocity over T, and the
// mean of its norms is not less than the norm of its mean: below, no motion explains it. Above,
// only the roughest does.
constexpr double kLowForce = 0.85, kHighForce = 1.6;      // of gravity, over kLongEnough
constexpr double kNoForce = 0.5, kImpossibleForce = 3.0;  // of gravity, whatever the motion
constexpr double kLongEnough = 5.0;                       // s
// Noise makes each sample another. A driver that fills a slow sensor up to the rate of a fast one
// repeats two of three.
constexpr double kFrozenShare = 0.4, kDeadShare = 0.95;
constexpr std::int64_t kEnough = 50;  // samples

bool IsSaturated(const ImuSample& sample, const ImuSpec& imu) {
  return sample.linear_acceleration.cwiseAbs().maxCoeff() >= 0.999 * imu.accelerometer_saturation ||
         sample.angular_velocity.cwiseAbs().maxCoeff() >= 0.999 * imu.gyroscope_saturation;
}

}  // namespace

void ImuWatch::Observe(const ImuSample& sample) {
  const auto observe = [](const Eigen::Vector3d& value, Triad& triad) {
    if (value == triad.newest) ++triad.repeated;
    triad.newest = value;
  };
  observe(sample.linear_acceleration, accelerometer_);
  observe(sample.angular_velocity, gyroscope_);
  force_sum_ += sample.linear_acceleration.norm();
  ++samples_;
  if (IsSaturated(sample, spec_)) ++saturated_;
  if (!first_.valid()) first_ = sample.stamp;
  newest_ = sample.stamp;
}

std::vector<Health> ImuWatch::Findings() const {
  std::vector<Health> findings;
  if (samples_ >= kEnough) {
    AddForce(findings);
    AddFrozen(accelerometer_, "accelerometer", findings);
    AddFrozen(gyroscope_, "gyroscope", findings);
  }
  if (saturated_ > 0) {
    findings.push_back(
        {HealthLevel::kDegraded, fmt::format("{} samples at saturation", saturated_)});
  }
  return findings;
}

void ImuWatch::AddForce(std::vector<Health>& findings) const {
  const double force = force_sum_ / static_cast<double>(samples_);
  const double share = force / gravity_;
  const bool impossible = share < kNoForce || share > kImpossibleForce;
  const bool odd =
      (newest_ - first_).seconds() >= kLongEnough && (share < kLowForce || share > kHighForce);
  if (!impossible && !odd) return;
  findings.push_back(
      {impossible ? HealthLevel::kFailed : HealthLevel::kDegraded,
       fmt::format("accelerations of {:.3f} m/s^2 on average, gravity is {:.2f}: is it specific "
                   "force, not acceleration without gravity? Else check imu.acceleration_unit",
                   force, gravity_)});
}

void ImuWatch::AddFrozen(const Triad& triad, const char* name,
                         std::vector<Health>& findings) const {
  const double share = static_cast<double>(triad.repeated) / static_cast<double>(samples_ - 1);
  if (share < kFrozenShare) return;
  findings.push_back(
      {share > kDeadShare ? HealthLevel::kFailed : HealthLevel::kDegraded,
       fmt::format("the {} repeats its value in {:.0f} % of the samples (last: {:g}, {:g}, {:g}): "
                   "it or its driver hangs, or is slower than the samples are",
                   name, 100.0 * share, triad.newest.x(), triad.newest.y(), triad.newest.z())});
}

}  // namespace mlvi

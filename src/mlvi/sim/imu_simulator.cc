// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/imu_simulator.h"

#include <algorithm>
#include <cmath>

#include "mlvi/sim/random_direction.h"

namespace mlvi {
namespace {

Eigen::Vector3d NormalVector(RandomStream& random, double sigma) {
  const double x = random.Normal(), y = random.Normal(), z = random.Normal();
  return {sigma * x, sigma * y, sigma * z};
}

Eigen::Vector3d UniformVector(RandomStream& random, double limit) {
  const double x = random.Uniform(-limit, limit), y = random.Uniform(-limit, limit),
               z = random.Uniform(-limit, limit);
  return {x, y, z};
}

Eigen::Vector3d Saturated(const Eigen::Vector3d& value, double limit) {
  return value.cwiseMax(-limit).cwiseMin(limit);
}

}  // namespace

ImuSimulator::ImuSimulator(const ImuPhysics& physics, const PoseSpline& motion, Time begin,
                           Time end, const RandomStream& random)
    : physics_(physics), motion_(&motion), begin_(begin), noise_(random.Fork(0)) {
  MLVI_CHECK(physics.rate_hz > 0.0, "IMU rate {} Hz", physics.rate_hz);
  MLVI_CHECK(begin >= motion.begin() && end <= motion.end(), "motion ends at {}, the IMU at {}",
             ToString(motion.end()), ToString(end));
  DrawBiases(end, random);
  const ImuErrors& errors = physics.errors;
  vibration_ = MakeVibration(errors.vibration, physics.rate_hz, size(), random.Fork(2));
  RandomStream sensitivity = random.Fork(4);
  accelerometer_sensitivity_ = DrawSensitivity(errors.sensitivity.accelerometer, sensitivity);
  gyroscope_sensitivity_ = DrawSensitivity(errors.sensitivity.gyroscope, sensitivity);
}

void ImuSimulator::DrawBiases(Time end, const RandomStream& random) {
  RandomStream walk = random.Fork(1), directions = random.Fork(3);
  ImuBias bias{.accelerometer = UniformVector(walk, physics_.initial_accelerometer_bias),
               .gyroscope = UniformVector(walk, physics_.initial_gyroscope_bias)};
  const double root_dt = std::sqrt(1.0 / physics_.rate_hz);
  const ImuWarmUp& warm_up = physics_.errors.warm_up;
  const Eigen::Vector3d accelerometer = warm_up.accelerometer * RandomDirection(directions),
                        gyroscope = warm_up.gyroscope * RandomDirection(directions);
  for (std::size_t i = 0; StampOf(i) <= end; ++i) {
    const double settled = -std::expm1(-(StampOf(i) - begin_).seconds() / warm_up.time_constant);
    biases_.push_back({.accelerometer = bias.accelerometer + settled * accelerometer,
                       .gyroscope = bias.gyroscope + settled * gyroscope});
    bias.accelerometer += NormalVector(walk, physics_.noise.accelerometer_random_walk * root_dt);
    bias.gyroscope += NormalVector(walk, physics_.noise.gyroscope_random_walk * root_dt);
  }
}

ImuSimulator::ImuSimulator(const ImuPhysics& physics, const RecordedImu& recorded, Duration shift,
                           Time begin, Time end)
    : physics_(physics), begin_(begin), noise_(0), recorded_biases_(recorded.biases) {
  for (ImuSample sample : recorded.samples) {
    sample.stamp = sample.stamp + shift;
    if (sample.stamp >= begin && sample.stamp <= end) recorded_.push_back(Saturate(sample));
  }
  for (auto& [stamp, bias] : recorded_biases_) stamp = stamp + shift;
  MLVI_CHECK(!recorded_.empty(), "none of {} IMU samples lies within the motion",
             recorded.samples.size());
}

ImuSample ImuSimulator::Saturate(ImuSample sample) const {
  sample.angular_velocity = Saturated(sample.angular_velocity, physics_.gyroscope_saturation);
  sample.linear_acceleration =
      Saturated(sample.linear_acceleration, physics_.accelerometer_saturation);
  return sample;
}

Time ImuSimulator::StampOf(std::size_t index) const {
  if (!recorded_.empty()) return recorded_[index].stamp;
  return begin_ + Duration::FromSeconds(static_cast<double>(index) / physics_.rate_hz);
}

ImuSample ImuSimulator::Sample(std::size_t index) const {
  MLVI_CHECK(index < size(), "IMU sample {} of {}", index, size());
  if (!recorded_.empty()) return recorded_[index];
  const Time stamp = StampOf(index);
  const MotionSample motion = motion_->At(stamp);
  RandomStream random = noise_.Fork(index);
  const double root_rate = std::sqrt(physics_.rate_hz);
  const Eigen::Vector3d gravity(0.0, 0.0, -physics_.gravity);
  const Vector6d vibration = vibration_.empty() ? Vector6d(Vector6d::Zero()) : vibration_[index];
  const Eigen::Vector3d rate = motion.angular_velocity + vibration.tail<3>();
  const Eigen::Vector3d force =
      motion.T_world_body.rotation().conjugate() * (motion.acceleration - gravity) +
      vibration.head<3>();
  const Eigen::Vector3d gyroscope =
      gyroscope_sensitivity_ * rate + biases_[index].gyroscope +
      NormalVector(random, physics_.noise.gyroscope_density * root_rate);
  const Eigen::Vector3d accelerometer =
      accelerometer_sensitivity_ * force + biases_[index].accelerometer +
      NormalVector(random, physics_.noise.accelerometer_density * root_rate);
  return Saturate(
      {.stamp = stamp, .angular_velocity = gyroscope, .linear_acceleration = accelerometer});
}

ImuBias ImuSimulator::BiasAt(Time time) const {
  if (!recorded_.empty()) {
    const auto after = std::find_if(recorded_biases_.begin(), recorded_biases_.end(),
                                    [&](const auto& known) { return known.first > time; });
    if (after != recorded_biases_.begin()) return std::prev(after)->second;
    return recorded_biases_.empty() ? ImuBias{} : recorded_biases_.front().second;
  }
  const double index = std::floor((time - begin_).seconds() * physics_.rate_hz + 1e-6);
  return biases_[static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(size() - 1)))];
}

}  // namespace mlvi

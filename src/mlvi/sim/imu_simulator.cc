// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/imu_simulator.h"

#include <algorithm>
#include <cmath>

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
  RandomStream walk = random.Fork(1);
  ImuBias bias{.accelerometer = UniformVector(walk, physics.initial_accelerometer_bias),
               .gyroscope = UniformVector(walk, physics.initial_gyroscope_bias)};
  const double root_dt = std::sqrt(1.0 / physics.rate_hz);
  for (std::size_t i = 0; StampOf(i) <= end; ++i) {
    biases_.push_back(bias);
    bias.accelerometer += NormalVector(walk, physics.noise.accelerometer_random_walk * root_dt);
    bias.gyroscope += NormalVector(walk, physics.noise.gyroscope_random_walk * root_dt);
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
  const Eigen::Vector3d force =
      motion.T_world_body.rotation().conjugate() * (motion.acceleration - gravity);
  const Eigen::Vector3d gyroscope =
      motion.angular_velocity + biases_[index].gyroscope +
      NormalVector(random, physics_.noise.gyroscope_density * root_rate);
  const Eigen::Vector3d accelerometer =
      force + biases_[index].accelerometer +
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

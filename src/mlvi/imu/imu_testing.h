// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// For tests: an analytic walk with exact states and IMU readings, and the noise of an IMU on top of
// them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/base/time.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/nav_state.h"

namespace mlvi::testing {

inline constexpr double kGravity = 9.81;

// R = Rz(yaw rate t) Exp(sway(t)) mount, p a line with sway and bob: a walk with a hand-held
// sensor. Scales of zero make it plain.
struct Walk {
  Eigen::Quaterniond mount{0.0, 1.0, 0.0, 0.0};          // body z down
  double yaw_rate = 0.5;                                 // rad/s
  Eigen::Vector3d sway_amplitude{0.10, 0.15, 0.05};      // rad
  Eigen::Vector3d sway_frequency{5.7, 11.3, 4.1};        // rad/s
  Eigen::Vector3d velocity{1.1, 0.4, 0.05};              // m/s
  Eigen::Vector3d position_amplitude{0.05, 0.06, 0.03};  // m
  Eigen::Vector3d position_frequency{11.3, 5.7, 11.3};   // rad/s
  Eigen::Vector3d phase{0.3, 1.1, 2.0};                  // rad

  static Time At(double t) {
    return Time::FromNanoseconds(1'600'000'000'000'000'000) + Duration::FromSeconds(t);
  }
  static double Seconds(Time stamp) { return (stamp - At(0.0)).seconds(); }

  NavState State(double t) const {
    const Eigen::Array3d x = position_frequency.array() * t + phase.array();
    const Eigen::Vector3d p = t * velocity + (position_amplitude.array() * x.sin()).matrix();
    NavState state;
    state.stamp = At(t);
    state.T_world_body = Pose3(Yaw(t) * ExpSo3(Sway(t)) * mount, p);
    state.v_world_body =
        velocity + (position_amplitude.array() * position_frequency.array() * x.cos()).matrix();
    return state;
  }

  // Without bias and noise.
  ImuSample Sample(double t) const {
    const Eigen::Array3d w = position_frequency.array();
    const Eigen::Vector3d a =
        (-position_amplitude.array() * w * w * (w * t + phase.array()).sin()).matrix();
    const Eigen::Vector3d sway = Sway(t), sway_rate = RightJacobianSo3(sway) * SwayDerivative(t);
    const Eigen::Vector3d rate =
        ExpSo3(sway).conjugate() * Eigen::Vector3d(0.0, 0.0, yaw_rate) + sway_rate;
    return {.stamp = At(t),
            .angular_velocity = mount.conjugate() * rate,
            .linear_acceleration = State(t).T_world_body.rotation().conjugate() *
                                   (a + Eigen::Vector3d(0, 0, kGravity))};
  }

  std::vector<ImuSample> Samples(double from, double to, double rate_hz) const {
    const int count = static_cast<int>(std::lround((to - from) * rate_hz));
    std::vector<ImuSample> samples;
    for (int k = 0; k <= count; ++k) samples.push_back(Sample(from + k / rate_hz));
    return samples;
  }

 private:
  Eigen::Quaterniond Yaw(double t) const { return ExpSo3({0.0, 0.0, yaw_rate * t}); }
  Eigen::Vector3d Sway(double t) const {
    return (sway_amplitude.array() * (sway_frequency.array() * t + phase.array()).sin()).matrix();
  }
  Eigen::Vector3d SwayDerivative(double t) const {
    return (sway_amplitude.array() * sway_frequency.array() *
            (sway_frequency.array() * t + phase.array()).cos())
        .matrix();
  }
};

// A tactical-grade MEMS IMU at 200 Hz, as the walking rigs carry it.
inline ImuSpec TestImu() {
  ImuSpec imu;
  imu.topic = "/imu";
  imu.rate_hz = 200.0;
  imu.noise = {.accelerometer_density = 2.0e-3,
               .gyroscope_density = 2.0e-4,
               .accelerometer_random_walk = 3.0e-3,
               .gyroscope_random_walk = 2.0e-5};
  return imu;
}

inline Eigen::Vector3d NormalVector(RandomStream& random, double sigma) {
  return sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
}

// Adds white noise and a bias that starts at `bias` and walks. Returns the bias at the last sample;
// `biases`, if given, takes those at all samples.
inline ImuBias AddImuNoise(const ImuSpec& imu, ImuBias bias, RandomStream& random,
                           std::vector<ImuSample>& samples,
                           std::vector<ImuBias>* biases = nullptr) {
  const double root_rate = std::sqrt(imu.rate_hz);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (k > 0) {
      bias.accelerometer += NormalVector(random, imu.noise.accelerometer_random_walk / root_rate);
      bias.gyroscope += NormalVector(random, imu.noise.gyroscope_random_walk / root_rate);
    }
    if (biases != nullptr) biases->push_back(bias);
    samples[k].linear_acceleration +=
        bias.accelerometer + NormalVector(random, imu.noise.accelerometer_density * root_rate);
    samples[k].angular_velocity +=
        bias.gyroscope + NormalVector(random, imu.noise.gyroscope_density * root_rate);
  }
  return bias;
}

}  // namespace mlvi::testing

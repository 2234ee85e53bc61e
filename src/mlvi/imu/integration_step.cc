// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/integration_step.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/geometry/so3.h"

namespace mlvi::internal {
namespace {

using nav_index::kAccelerometerBias;
using nav_index::kGyroscopeBias;
using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

// The Stumpff function c_k(x) = sum_n (-x)^n / (2n + k)! and its derivative.
struct Stumpff {
  double value, derivative;
};

// From c_0 = cos and c_1 = sin / theta, theta^2 = x, by c_k+2 = (1 / k! - c_k) / x; the derivative
// is (c_k-1 - k c_k) / (2 x). For pauses of the IMU, in which rates held for long turn far.
Stumpff StumpffOfLargeTurn(int k, double x) {
  const double theta = std::sqrt(x);
  double before = std::cos(theta), c = std::sin(theta) / theta;  // c_0, c_1
  double factorial = 1.0;                                        // (i - 2)!
  for (int i = 2; i <= k; ++i) {
    const double next = (1.0 / factorial - before) / x;
    before = c;
    c = next;
    factorial *= i - 1;
  }
  return {.value = c, .derivative = (before - k * c) / (2.0 * x)};
}

// Twelve terms of the series reach double precision for x < 10, that is turns of up to half a
// circle within one interval.
Stumpff EvaluateStumpff(int k, double x) {
  if (x > 8.0) return StumpffOfLargeTurn(k, x);
  double factorial = 1.0;
  for (int i = 2; i <= k; ++i) factorial *= i;
  double term = 1.0 / factorial;  // of (-x)^n, without the power
  Stumpff c{.value = term, .derivative = 0.0};
  double power = 1.0;  // (-x)^(n-1)
  for (int n = 1; n < 12; ++n) {
    term /= (2.0 * n + k) * (2.0 * n + k - 1.0);
    c.derivative -= n * power * term;
    power *= -x;
    c.value += power * term;
  }
  return c;
}

// F_m(phi) a of the header and its derivatives.
struct ForceIntegral {
  Eigen::Vector3d value;
  Eigen::Matrix3d by_phi, by_a;
};

ForceIntegral IntegrateForce(int m, const Eigen::Vector3d& phi, const Eigen::Vector3d& a) {
  const Stumpff c = EvaluateStumpff(m + 1, phi.squaredNorm()),
                d = EvaluateStumpff(m + 2, phi.squaredNorm());
  const double constant = 1.0 / m;  // 1 / m! for m of 1 and 2
  const Eigen::Matrix3d hat = Hat(phi);
  const Eigen::Vector3d once = phi.cross(a), twice = phi.cross(once);
  return {.value = constant * a + c.value * once + d.value * twice,
          .by_phi = -c.value * Hat(a) - d.value * (hat * Hat(a) + Hat(once)) +
                    2.0 * (c.derivative * once + d.derivative * twice) * phi.transpose(),
          .by_a = constant * Eigen::Matrix3d::Identity() + c.value * hat + d.value * hat * hat};
}

// What the signal does between two samples is known only as far as it is smooth. A component of
// amplitude A (one sigma) and angular frequency W deviates from its chord over dt by A (W dt)^2 /
// 12 on average, and by A at most.
constexpr double kMotionAngularFrequency =
    20.0;                                // rad/s: gait and hand-held shaking have little above 3 Hz
constexpr double kRateAmplitude = 1.5;   // rad/s, of quick motion by hand
constexpr double kForceAmplitude = 5.0;  // m/s^2
constexpr double kGapPeriods = 1.5;

// Of the mean over `dt`, which is all of the `gap` between two measurements or a part of it. Parts
// have the variance of white noise, so that their integrals add up to that over the whole.
double GapVariance(double amplitude, double dt, double gap, double rate_hz) {
  if (rate_hz <= 0.0 || gap * rate_hz <= kGapPeriods) return 0.0;
  const double phase = kMotionAngularFrequency * gap;
  const double sigma = amplitude * std::min(1.0, phase * phase / 12.0);
  return sigma * sigma * gap / dt;
}

// s, between the measurements that enclose the interval from `first` to `second`.
double GapAround(const ImuSample& first, const ImuSample& second) {
  return std::max({second.stamp - first.stamp, first.interpolated_over, second.interpolated_over})
      .seconds();
}

// At the end of its range a sample says only "at least this much". Half the range again as one
// sigma covers what shocks exceed it by; other axes stay trustworthy.
constexpr double kSaturatedShare = 0.5;

Eigen::Vector3d SaturationVariance(const Eigen::Vector3d& first, const Eigen::Vector3d& second,
                                   double limit) {
  const Eigen::Array3d largest = first.cwiseAbs().cwiseMax(second.cwiseAbs());
  const double sigma = kSaturatedShare * limit;
  return (largest >= 0.999 * limit).select(Eigen::Array3d::Constant(sigma * sigma), 0.0);
}

}  // namespace

ImuStep IntegrateStep(const ImuSample& first, const ImuSample& second, const ImuBias& bias,
                      const ImuSpec& imu) {
  const double dt = (second.stamp - first.stamp).seconds();
  MLVI_CHECK(dt > 0.0, "IMU samples must be in strictly ascending order, {} follows {}",
             ToString(second.stamp), ToString(first.stamp));
  const Eigen::Vector3d rate =
      0.5 * (first.angular_velocity + second.angular_velocity) - bias.gyroscope;
  const Eigen::Vector3d force =
      0.5 * (first.linear_acceleration + second.linear_acceleration) - bias.accelerometer;
  const Eigen::Vector3d phi = rate * dt;
  const ForceIntegral v = IntegrateForce(1, phi, force), p = IntegrateForce(2, phi, force);
  const double gap = GapAround(first, second);
  const auto variance = [&](double density, double amplitude) {
    return density * density / dt + GapVariance(amplitude, dt, gap, imu.rate_hz);
  };
  ImuStep step;
  step.dt = dt;
  step.rotation = ExpSo3(phi);
  step.velocity = dt * v.value;
  step.position = dt * dt * p.value;
  step.rotation_by_rate = dt * RightJacobianSo3(phi);
  step.velocity_by_rate = dt * dt * v.by_phi;
  step.velocity_by_force = dt * v.by_a;
  step.position_by_rate = dt * dt * dt * p.by_phi;
  step.position_by_force = dt * dt * p.by_a;
  step.rate_variance =
      SaturationVariance(first.angular_velocity, second.angular_velocity, imu.gyroscope_saturation)
          .array() +
      variance(imu.noise.gyroscope_density, kRateAmplitude);
  step.force_variance = SaturationVariance(first.linear_acceleration, second.linear_acceleration,
                                           imu.accelerometer_saturation)
                            .array() +
                        variance(imu.noise.accelerometer_density, kForceAmplitude);
  return step;
}

Matrix15d StepTransition(const Eigen::Matrix3d& R, const ImuStep& step) {
  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(kPosition, kVelocity) = step.dt * Eigen::Matrix3d::Identity();
  F.block<3, 3>(kPosition, kRotation) = -R * Hat(step.position);
  F.block<3, 3>(kPosition, kAccelerometerBias) = -R * step.position_by_force;
  F.block<3, 3>(kPosition, kGyroscopeBias) = -R * step.position_by_rate;
  F.block<3, 3>(kVelocity, kRotation) = -R * Hat(step.velocity);
  F.block<3, 3>(kVelocity, kAccelerometerBias) = -R * step.velocity_by_force;
  F.block<3, 3>(kVelocity, kGyroscopeBias) = -R * step.velocity_by_rate;
  F.block<3, 3>(kRotation, kRotation) = step.rotation.toRotationMatrix().transpose();
  F.block<3, 3>(kRotation, kGyroscopeBias) = -step.rotation_by_rate;
  return F;
}

Matrix15d StepNoise(const Eigen::Matrix3d& R, const ImuStep& step, const ImuNoise& noise) {
  Eigen::Matrix<double, 9, 6> G;  // of p, v, R by the mean rate and the mean force
  G << R * step.position_by_rate, R * step.position_by_force, R * step.velocity_by_rate,
      R * step.velocity_by_force, step.rotation_by_rate, Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 6, 1> variance;
  variance << step.rate_variance, step.force_variance;
  Matrix15d Q = Matrix15d::Zero();
  Q.topLeftCorner<9, 9>() = G * variance.asDiagonal() * G.transpose();
  // White noise within the interval moves the position by s^2 dt^3 / 3, of which its mean explains
  // s^2 dt^3 / 4. The rest keeps the covariance of a single interval regular.
  Q.block<3, 3>(kPosition, kPosition) +=
      R * (step.force_variance * (std::pow(step.dt, 4) / 12.0)).asDiagonal() * R.transpose();
  const double accelerometer = noise.accelerometer_random_walk,
               gyroscope = noise.gyroscope_random_walk;
  Q.diagonal().segment<3>(kAccelerometerBias).setConstant(accelerometer * accelerometer * step.dt);
  Q.diagonal().segment<3>(kGyroscopeBias).setConstant(gyroscope * gyroscope * step.dt);
  return Q;
}

}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/imu_errors.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace mlvi {
namespace {

using Amplitude = Eigen::Matrix<std::complex<double>, 6, 1>;

// Real and imaginary parts of variance 1.
Amplitude DrawAmplitude(RandomStream& random) {
  Amplitude amplitude;
  for (auto& element : amplitude) {
    const double real = random.Normal(), imaginary = random.Normal();
    element = {real, imaginary};
  }
  return amplitude;
}

}  // namespace

bool HasErrors(const ImuErrors& errors) {
  return errors.vibration.acceleration > 0.0 || errors.vibration.rate > 0.0 ||
         errors.warm_up.accelerometer > 0.0 || errors.warm_up.gyroscope > 0.0 ||
         errors.sensitivity.accelerometer > 0.0 || errors.sensitivity.gyroscope > 0.0;
}

std::vector<Vector6d> MakeVibration(const ImuVibration& vibration, double rate_hz,
                                    std::size_t count, RandomStream random) {
  if (vibration.acceleration <= 0.0 && vibration.rate <= 0.0) return {};
  std::vector<Vector6d> sum(count, Vector6d::Zero());
  Vector6d rms;
  rms << Eigen::Vector3d::Constant(vibration.acceleration),
      Eigen::Vector3d::Constant(vibration.rate);
  rms /= std::sqrt(static_cast<double>(kVibrationModes));
  const double kept = std::exp(-1.0 / (rate_hz * kVibrationDecay));
  const double added = std::sqrt(1.0 - kept * kept);
  for (int mode = 0; mode < kVibrationModes; ++mode) {
    const double frequency = random.Uniform(vibration.lowest, vibration.highest);
    Amplitude amplitude = DrawAmplitude(random);
    for (std::size_t k = 0; k < count; ++k) {
      const double phase =
          2.0 * std::numbers::pi * std::fmod(frequency * static_cast<double>(k) / rate_hz, 1.0);
      sum[k] += rms.cwiseProduct((amplitude * std::polar(1.0, phase)).real());
      amplitude = kept * amplitude + added * DrawAmplitude(random);
    }
  }
  return sum;
}

Eigen::Matrix3d DrawSensitivity(double limit, RandomStream& random) {
  Eigen::Matrix3d sensitivity = Eigen::Matrix3d::Identity();
  for (double& element : sensitivity.reshaped()) element += random.Uniform(-limit, limit);
  return sensitivity;
}

}  // namespace mlvi

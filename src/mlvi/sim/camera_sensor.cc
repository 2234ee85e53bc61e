// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

constexpr std::size_t kCurve = 1024;
constexpr std::size_t kQuantiles = 4096;

// The x with standard normal distribution Phi(x) = p, by bisection: only for tables.
double NormalQuantile(double p) {
  double low = -8.0, high = 8.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const double phi = 0.5 * std::erfc(-middle / std::numbers::sqrt2);
    (phi < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

CameraSensor::CameraSensor(const CameraPhysics& physics) : physics_(physics) {
  for (std::size_t i = 0; i <= kCurve; ++i) {
    const double root = static_cast<double>(i) / kCurve;
    curve_.push_back(static_cast<float>(255.0 * std::pow(root, 2.0 / physics.gamma)));
  }
  curve_.push_back(255.0F);
  double squares = 0.0;
  for (std::size_t i = 0; i < kQuantiles; ++i) {
    normals_.push_back(
        static_cast<float>(NormalQuantile((static_cast<double>(i) + 0.5) / kQuantiles)));
    squares += normals_.back() * normals_.back();
  }
  // The tails beyond the outermost quantiles are missing; the variance is made whole.
  const auto scale = static_cast<float>(std::sqrt(kQuantiles / squares));
  for (float& x : normals_) x *= scale;
}

double CameraSensor::Grey(double signal) const {
  const double x = kCurve * std::sqrt(std::clamp(signal, 0.0, 1.0));
  const auto i = static_cast<std::size_t>(x);
  const double share = x - static_cast<double>(i);
  return (1.0 - share) * static_cast<double>(curve_[i]) +
         share * static_cast<double>(curve_[i + 1]);
}

double CameraSensor::Normal(RandomStream& random) const {
  return static_cast<double>(normals_[random.NextBits() >> 52]);
}

double CameraSensor::Expected(double luminance, const Exposure& exposure) const {
  const double electrons =
      luminance * physics_.lens_gain * physics_.electrons_per_lux_second * exposure.seconds;
  return Grey(Signal(electrons, exposure.gain));
}

std::uint8_t CameraSensor::Expose(double luminance, const Exposure& exposure,
                                  RandomStream& random) const {
  const double electrons =
      luminance * physics_.lens_gain * physics_.electrons_per_lux_second * exposure.seconds;
  const double sigma = std::sqrt(electrons + physics_.read_noise * physics_.read_noise);
  const double grey = Grey(Signal(electrons + sigma * Normal(random), exposure.gain));
  return static_cast<std::uint8_t>(grey + 0.5);
}

Exposure CameraSensor::Split(double exposure_times_gain) const {
  Exposure exposure;
  exposure.seconds = std::clamp(exposure_times_gain, physics_.min_exposure, physics_.max_exposure);
  exposure.gain = std::clamp(exposure_times_gain / exposure.seconds, 1.0, physics_.max_gain);
  return exposure;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/sim/tile_noise.h"

namespace mlvi {
namespace {

constexpr double kSunRadius = 0.00465;      // rad
constexpr double kSunSolidAngle = 6.79e-5;  // sr

// x^200 by squares; std::pow takes ten times as long.
double PowerOf200(double x) {
  const double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8;
  const double x32 = x16 * x16, x64 = x32 * x32;
  return x64 * x64 * x64 * x8;
}

// Clouds on a plane high above, repeating only beyond the horizon; mean 1.
double Clouds(const Eigen::Vector3d& direction) {
  const double height = direction.z() + 0.15;
  const auto wrapped = [](double x) { return static_cast<float>(x - std::floor(x)); };
  const float noise = internal::TileNoise(7).Fractal(
      wrapped(0.05 * direction.x() / height), wrapped(0.05 * direction.y() / height), 16, 16, 4, 1);
  return 0.8 + 0.4 * static_cast<double>(noise);
}

}  // namespace

double SkyLuminance(const Lighting& lighting, const Eigen::Vector3d& direction) {
  if (lighting.sky_illuminance <= 0.0 && lighting.sun_illuminance <= 0.0) return 0.0;
  const double level = lighting.sky_illuminance / std::numbers::pi;
  if (direction.z() <= 0.0) return 0.25 * level;
  const double haze = 1.0 - direction.z();
  // The cosine-weighted mean of haze^3 over the hemisphere is 0.1, so that of the sum is 1.
  const double gradient = 0.9 + haze * haze * haze;
  const double to_sun = std::max(0.0, direction.dot(lighting.sun_direction));
  const double glow = 0.3 * lighting.sun_illuminance / std::numbers::pi * PowerOf200(to_sun);
  return level * gradient * Clouds(direction) + glow;
}

double SkyAndSunLuminance(const Lighting& lighting, const Eigen::Vector3d& direction) {
  const bool disc = direction.dot(lighting.sun_direction) > std::cos(kSunRadius);
  return SkyLuminance(lighting, direction) +
         (disc ? lighting.sun_illuminance / kSunSolidAngle : 0.0);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/equal_area_sphere.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

EqualAreaSphere::EqualAreaSphere(int cells) {
  MLVI_CHECK(cells >= 2, "{} cells: a sphere has at least two", cells);
  const double side = std::sqrt(4.0 * kPi / cells);
  const int bands = std::max(2, static_cast<int>(std::lround(kPi / side)));
  for (int i = 0; i < bands; ++i) {
    const double south = -0.5 * kPi + kPi * i / bands, north = south + kPi / bands;
    const double area = 2.0 * kPi * (std::sin(north) - std::sin(south));
    const int count = std::max(1, static_cast<int>(std::lround(area / (side * side))));
    bands_.push_back({.first = size_, .count = count});
    size_ += count;
  }
  for (Band& band : bands_) {
    band.z_low = -1.0 + 2.0 * band.first / size_;
    band.z_high = -1.0 + 2.0 * (band.first + band.count) / size_;
  }
}

EqualAreaSphere EqualAreaSphere::WithCellAngle(double angle) {
  MLVI_CHECK(angle > 0.0 && angle <= kPi, "cell angle {} rad: must be in (0, pi]", angle);
  return EqualAreaSphere(std::max(2, static_cast<int>(std::lround(4.0 * kPi / (angle * angle)))));
}

double EqualAreaSphere::area() const { return 4.0 * kPi / size_; }

double EqualAreaSphere::cell_angle() const { return std::sqrt(area()); }

int EqualAreaSphere::BandOf(double z) const {
  // Bands are nearly equal steps of latitude: the guess is at most a band off.
  const int count = static_cast<int>(bands_.size());
  const double latitude = std::asin(std::clamp(z, -1.0, 1.0));
  int band = std::clamp(static_cast<int>((latitude / kPi + 0.5) * count), 0, count - 1);
  while (band > 0 && z < bands_[band].z_low) --band;
  while (band + 1 < count && z >= bands_[band].z_high) ++band;
  return band;
}

int EqualAreaSphere::CellOf(const Eigen::Vector3d& direction) const {
  const double norm = direction.norm();
  MLVI_CHECK(norm > 0.0 && std::isfinite(norm), "direction of length {}", norm);
  const Band& band = bands_[BandOf(direction.z() / norm)];
  const double turn = std::atan2(direction.y(), direction.x()) / (2.0 * kPi) + 0.5;
  return band.first + std::clamp(static_cast<int>(turn * band.count), 0, band.count - 1);
}

Eigen::Vector3d EqualAreaSphere::Center(int cell) const {
  MLVI_CHECK(cell >= 0 && cell < size_, "cell {} of {}", cell, size_);
  const Band& band = bands_[BandOf(-1.0 + 2.0 * (cell + 0.5) / size_)];
  const double z = 0.5 * (band.z_low + band.z_high), rho = std::sqrt(1.0 - z * z);
  const double azimuth = 2.0 * kPi * ((cell - band.first + 0.5) / band.count - 0.5);
  return {rho * std::cos(azimuth), rho * std::sin(azimuth), z};
}

}  // namespace mlvi

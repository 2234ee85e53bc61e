// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/value_noise.h"

#include <array>
#include <cmath>

namespace mlvi {

// A hash of the lattice point, mixed as SplitMix64 does.
double ValueNoise::Lattice(std::int64_t x, std::int64_t y, std::int64_t z) const {
  std::uint64_t h = seed_ ^ (static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL) ^
                    (static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fULL) ^
                    (static_cast<std::uint64_t>(z) * 0x165667b19e3779f9ULL);
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ULL;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebULL;
  h ^= h >> 31;
  return static_cast<double>(h >> 11) * 0x1.0p-52 - 1.0;
}

double ValueNoise::At(const Eigen::Vector3d& point) const {
  std::array<std::int64_t, 3> cell{};
  std::array<double, 3> fade{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = point[static_cast<Eigen::Index>(axis)], floor = std::floor(value);
    const double t = value - floor;
    cell[axis] = static_cast<std::int64_t>(floor);
    fade[axis] = t * t * t * (10.0 + t * (-15.0 + 6.0 * t));
  }
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
    const double weight = (i ? fade[0] : 1.0 - fade[0]) * (j ? fade[1] : 1.0 - fade[1]) *
                          (k ? fade[2] : 1.0 - fade[2]);
    sum += weight * Lattice(cell[0] + i, cell[1] + j, cell[2] + k);
  }
  return sum;
}

double ValueNoise::Fractal(const Eigen::Vector3d& point, int octaves) const {
  double sum = 0.0, amplitude = 1.0, scale = 1.0;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * At(scale * point);
    amplitude *= 0.5;
    scale *= 2.0;
  }
  return sum;
}

}  // namespace mlvi

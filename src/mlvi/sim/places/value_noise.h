// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace mlvi {

// Smooth random field over space (lattice values joined by quintic interpolation; Perlin,
// "Improving noise", 2002, for the fade curve), in [-1, 1], of features about 1 m across.
class ValueNoise {
 public:
  explicit ValueNoise(std::uint64_t seed) : seed_(seed) {}

  double At(const Eigen::Vector3d& point) const;
  // Sum of `octaves` fields, each twice as fine and half as strong as the one before.
  double Fractal(const Eigen::Vector3d& point, int octaves) const;

 private:
  double Lattice(std::int64_t x, std::int64_t y, std::int64_t z) const;

  std::uint64_t seed_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace mlvi {

// A cell of a regular grid, packed into 64 bits: 21 bits per axis, so +-2^20 cells around the
// origin (524 km at 0.5 m); beyond that the grid wraps around.
class VoxelKey {
 public:
  constexpr VoxelKey() = default;
  constexpr VoxelKey(int x, int y, int z) : bits_(Pack(x) << 42 | Pack(y) << 21 | Pack(z)) {}
  static VoxelKey Of(const Eigen::Vector3f& point, float inverse_size) {
    return VoxelKey(Floor(point.x() * inverse_size), Floor(point.y() * inverse_size),
                    Floor(point.z() * inverse_size));
  }

  constexpr bool operator==(const VoxelKey&) const = default;
  constexpr std::uint64_t bits() const { return bits_; }
  // Never the bits of a real key: bit 63 stays clear in those.
  static constexpr std::uint64_t kInvalidBits = ~std::uint64_t{0};

  // Multiplicative hash (Fibonacci); take the upper bits.
  constexpr std::uint64_t Hash() const { return (bits_ ^ (bits_ >> 29)) * 0x9e3779b97f4a7c15ULL; }

  // Largest integer not above `value`; std::floor is a library call on baseline x86-64.
  static int Floor(float value) {
    const int truncated = static_cast<int>(value);
    return truncated - (static_cast<float>(truncated) > value ? 1 : 0);
  }

 private:
  static constexpr std::uint64_t Pack(int v) { return static_cast<std::uint64_t>(v) & 0x1fffffU; }
  std::uint64_t bits_ = kInvalidBits;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rays that are traced together, several times as fast as one by one where they run much the same
// way: neighbouring pixels, samples of one pixel, rays towards the sun.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace mlvi {

template <std::size_t N>
struct RayPacketOf {
  static constexpr int kSize = static_cast<int>(N);
  using Lanes = std::array<float, N>;

  unsigned active = 0;                             // bit i: ray i is traced
  bool coherent = true;                            // whether the rays run much the same way
  alignas(4 * N) Lanes x = {}, y = {}, z = {};     // m, origins
  alignas(4 * N) Lanes dx = {}, dy = {}, dz = {};  // unit directions
  alignas(4 * N) Lanes limit = {};                 // m

  bool IsActive(int i) const { return (active >> i & 1U) != 0; }
  void Set(int i, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
           float max_range) {
    const auto k = static_cast<std::size_t>(i);
    active |= 1U << i;
    x[k] = origin.x(), y[k] = origin.y(), z[k] = origin.z();
    dx[k] = direction.x(), dy[k] = direction.y(), dz[k] = direction.z();
    limit[k] = max_range;
  }
  Eigen::Vector3f Origin(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {x[k], y[k], z[k]};
  }
  Eigen::Vector3f Direction(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {dx[k], dy[k], dz[k]};
  }
};

using RayPacket = RayPacketOf<8>;
// A third faster per ray than eight where the processor has vectors of 64 bytes.
using WideRayPacket = RayPacketOf<16>;

// What one of the rays met first.
struct PacketHit {
  float range = 0.0F;                                // m along the ray; 0: nothing
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, on the side that the ray comes from
  std::uint32_t triangle = 0;                        // of the mesh of world or part
  Eigen::Vector2f barycentric = Eigen::Vector2f::Zero();  // weights of its second and third vertex
  std::int16_t object = -1;                               // index of the moving object; -1: static
  std::int16_t part = 0;                                  // of the moving object
};

template <std::size_t N>
using PacketHitsOf = std::array<PacketHit, N>;
using PacketHits = PacketHitsOf<8>;

}  // namespace mlvi

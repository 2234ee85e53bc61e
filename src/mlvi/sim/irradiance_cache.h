// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "mlvi/sim/world.h"

namespace mlvi {

// The soft light on the static surfaces of a world: from the sky (with one bounce of sky and sun)
// and from lamps (direct and with one bounce), in lux. It is computed at the nodes of a lattice on
// every triangle, about 0.4 m wide, when a node is first asked for, and interpolated between them;
// triangles that share an edge of equal division share its nodes' values, so that no seam shows.
// Where they differ much, only nodes count that the point sees along the surface: no light leaks
// past what pierces a triangle or stands on it.
// A node's value depends on the node alone: the same bits in any order and from any thread.
class IrradianceCache {
 public:
  struct Irradiance {
    float sky = 0.0F;
    float lamps = 0.0F;
  };

  // `albedos`: mean reflectance by material of the world's mesh. `world` must outlive the cache.
  IrradianceCache(const World& world, std::vector<float> albedos);

  // At a point of a triangle; `normal` is its unit normal on the side that is looked at.
  Irradiance At(std::uint32_t triangle, const Eigen::Vector2f& barycentric,
                const Eigen::Vector3d& normal) const;

 private:
  struct Lattice {
    std::size_t first = 0;  // index of its first node; nodes of the other side follow
    int divisions = 1;      // of each edge
    unsigned joined = 0;    // edges (bits: ab, ac, bc) that go on in the same plane
  };
  struct Node {
    int i = 0, j = 0;  // column and row in the lattice
  };
  void FindJoinedEdges();
  void FindCornerPulls();
  Eigen::Vector3d NodePoint(std::uint32_t triangle, int i, int j) const;
  Irradiance NodeValue(std::uint32_t triangle, int i, int j, bool front,
                       const Eigen::Vector3d& normal) const;
  void LeaveOutHidden(std::uint32_t triangle, const std::array<Node, 3>& nodes,
                      const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                      const std::array<Irradiance, 3>& values, std::array<float, 3>& weights) const;
  Irradiance Compute(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  double LampsAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, std::size_t limit,
                 double nearest) const;

  const World* world_;
  std::vector<float> albedos_;
  // By triangle and corner: into the middle of the triangles that share the corner in one plane.
  std::vector<std::array<Eigen::Vector3f, 3>> corner_pulls_;
  std::vector<Lattice> lattices_;                         // by triangle
  std::unique_ptr<std::atomic<std::uint64_t>[]> values_;  // two floats; 0: not yet known
  std::vector<Eigen::Vector3d> directions_;               // cosine-weighted around z
};

}  // namespace mlvi

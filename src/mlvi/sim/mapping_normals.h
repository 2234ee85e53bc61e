// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "mlvi/sim/world.h"

namespace mlvi {

// The direction from which a texture is laid on a mesh. On round things and rough ground it turns
// evenly from facet to facet (facets up to 50 degrees apart share the normals of their corners), so
// that textures laid along the axes blend without a seam; at the edges of boxes it jumps.
class MappingNormals {
 public:
  explicit MappingNormals(const TriangleMesh& mesh);

  // Not of unit length; in the frame of the mesh. `barycentric`: of the second and third corner.
  // `flat`: the triangle's own normal, which holds where its neighbours lie in one plane with it.
  Eigen::Vector3f At(std::uint32_t triangle, const Eigen::Vector2f& barycentric,
                     const Eigen::Vector3f& flat) const {
    const std::int32_t curved = curved_[triangle];
    if (curved < 0) return flat;
    const auto& n = corners_[static_cast<std::size_t>(curved)];
    return n[0] + barycentric.x() * (n[1] - n[0]) + barycentric.y() * (n[2] - n[0]);
  }

 private:
  std::vector<std::int32_t> curved_;  // by triangle: index in corners_, or -1
  std::vector<std::array<Eigen::Vector3f, 3>> corners_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sim/places/shapes.h"

namespace mlvi {

struct PlantMaterials {
  MaterialId bark, leaf;
};

struct TreeShape {
  double height = 9.0;         // m
  double crown = 2.5;          // m, radius of the crown
  double clear_trunk = 2.2;    // m, height of the lowest branches
  int branches = 8;            //
  int leaves_per_branch = 90;  // triangles
};

// A leaning, tapering trunk with branches that carry clusters of leaves.
void AddBranchedTree(MeshBuilder& builder, const Eigen::Vector3d& base, const TreeShape& shape,
                     const PlantMaterials& materials, RandomStream& random);

// Leaves filling a box in the frame of `place` (centred, standing on its origin): hedges, shrubs,
// ivy.
void AddFoliage(MeshBuilder& builder, const Placement& place, const Eigen::Vector3d& size,
                int leaves, double leaf_size, MaterialId material, RandomStream& random);

}  // namespace mlvi

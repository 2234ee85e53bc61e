// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Uneven grounds and natural surfaces.
#pragma once

#include <functional>

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

// Height (m) over (x, y).
using HeightField = std::function<double(double, double)>;

// The surface over the rectangle on a grid of about `cell` m.
void AddTerrain(MeshBuilder& builder, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                double cell, const HeightField& height, MaterialId material);

// The oval of half axes `radii` around `centre`, over `height`, with a kerb of `kerb` m down to the
// ground around it.
void AddOval(MeshBuilder& builder, const Eigen::Vector2d& centre, const Eigen::Vector2d& radii,
             const HeightField& height, double kerb, MaterialId material, MaterialId kerb_material);

// Signed distance (m, or a field that behaves like it near 0): negative inside.
using DistanceField = std::function<double(const Eigen::Vector3d&)>;

// The zero surface of `distance` within a box, of quads about `cell` m wide: surface nets (Gibson,
// "Constrained elastic surface nets", 1998), one vertex per cell with a change of sign at the mean
// of its edges' crossings. Open where the surface leaves the box.
void AddIsosurface(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                   double cell, const DistanceField& distance, MaterialId material);

}  // namespace mlvi

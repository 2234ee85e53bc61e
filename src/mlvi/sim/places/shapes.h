// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Shapes between those of MeshBuilder and whole parts of buildings.
#pragma once

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

// Where a thing stands: local x along `yaw` (rad about z), y to its left, z up.
struct Placement {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double yaw = 0.0;

  Eigen::Vector3d Direction(double x, double y) const;
  Eigen::Vector3d At(double x, double y, double z = 0.0) const;
  // A thing of its own, placed in this one's frame.
  Placement Within(double x, double y, double z = 0.0, double turn = 0.0) const;
};

// A box in the frame of `place`: centred on (x, y), standing on z.
void AddBoxAt(MeshBuilder& builder, const Placement& place, const Eigen::Vector3d& base,
              const Eigen::Vector3d& size, MaterialId material);

// A bar of rectangular section from `from` to `to` (different points): `width` across, horizontal
// unless the bar is upright, `height` the other way.
void AddBeam(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double width, double height, MaterialId material);

// A tube with closed ends, its radius changing from `radius_from` to `radius_to` (both > 0).
void AddPipe(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double radius_from, double radius_to, int sides, MaterialId material);

// A handrail 0.95 m above the line from `from` to `to` on posts about `spacing` m apart.
void AddRailing(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double spacing, MaterialId material);

// A polygon in the plane through `points` (convex, in order around it).
void AddPolygon(MeshBuilder& builder, const std::vector<Eigen::Vector3d>& points,
                MaterialId material);

// The solid between the convex outline `profile` (x, z in the frame of `place`) moved to y = -half
// and y = +half.
void AddExtrusion(MeshBuilder& builder, const Placement& place,
                  const std::vector<Eigen::Vector2d>& profile, double half, MaterialId material);

}  // namespace mlvi

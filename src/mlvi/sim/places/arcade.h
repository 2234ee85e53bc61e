// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rows of arches, vaults, roofs of beams.
#pragma once

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

struct ArcadeStyle {
  MaterialId stone;
  double bay = 3.0;                 // m from pier to pier
  double pier = 0.55;               // m, width of a pier; jittered by a tenth
  double thickness = 0.5;           // m, of the wall
  double spring = 2.2;              // m, height where the arches begin
  double rise = 1.0;                // m, of the arches; half their width makes them round
  double height = 4.2;              // m, of the wall
  double parapet = 0.0;             // m; 0: the arches are passages
  bool mullion = false;             // a thin column and bars in every arch
  std::vector<int> open_bays = {};  // without parapet and mullion
};

// From `corner` along the horizontal unit vector `along`; the wall's middle plane is on that line.
void AddArcade(MeshBuilder& builder, const Eigen::Vector3d& corner, const Eigen::Vector3d& along,
               double length, const ArcadeStyle& style, RandomStream& random);

// A barrel vault over the strip from `corner` along `along` (length m) and to its right (width m),
// springing at the height of `corner`.
void AddBarrelVault(MeshBuilder& builder, const Eigen::Vector3d& corner,
                    const Eigen::Vector3d& along, double length, double width, double rise,
                    int segments, MaterialId material);

// Two roof slopes over the same strip, with rafters every `spacing` m and a tie beam on every third
// of them.
struct RoofMaterials {
  MaterialId boards, beams;
};
void AddTimberRoof(MeshBuilder& builder, const Eigen::Vector3d& corner,
                   const Eigen::Vector3d& along, double length, double width, double rise,
                   double spacing, const RoofMaterials& materials, RandomStream& random);

}  // namespace mlvi

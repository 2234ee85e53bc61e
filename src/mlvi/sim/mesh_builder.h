// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/sim/world.h"

namespace mlvi {

using MaterialId = std::uint16_t;

// A rectangular opening of a panel, in the panel's plane.
struct PanelHole {
  double u0 = 0.0, u1 = 0.0, v0 = 0.0, v1 = 0.0;  // m, extent along the panel's width and height
  double depth = 0.2;  // m, of the reveals, against the normal; 0 only if open
  bool open = false;   // a passage; else closed by a back of `back` (window pane, door leaf)
  MaterialId back = 0;
  std::optional<MaterialId> reveal = {};  // default: the panel's material
};

// A plane rectangle in space: corner, unit vectors along width and height, and their size. Its
// normal is u x v.
struct PanelFrame {
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  Eigen::Vector3d u = Eigen::Vector3d::UnitX();
  Eigen::Vector3d v = Eigen::Vector3d::UnitZ();
  double width = 1.0;
  double height = 1.0;
};

// Collects the triangles of a world from the shapes of buildings and nature.
class MeshBuilder {
 public:
  MaterialId AddMaterial(const Material& material);
  // With the look that UsualMaterial knows for the name.
  MaterialId AddMaterial(const std::string& name, double reflectivity);

  void AddTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   MaterialId material);
  // With the texture coordinates of its corners (TextureMapping::kVertex).
  void AddTriangle(const std::array<Eigen::Vector3d, 3>& corners,
                   const std::array<Eigen::Vector2d, 3>& texture_coordinates, MaterialId material);
  // Corners in order around it.
  void AddQuad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
               const Eigen::Vector3d& d, MaterialId material);
  // Centred on `base` in x and y, standing on it, `size` along its own axes, turned by `yaw` rad
  // about z.
  void AddBox(const Eigen::Vector3d& base, const Eigen::Vector3d& size, double yaw,
              MaterialId material);
  // Holes lie inside the panel and do not overlap.
  void AddPanel(const PanelFrame& frame, MaterialId material,
                const std::vector<PanelHole>& holes = {});
  // A closed cylinder-like trunk of `sides` sides.
  void AddColumn(const Eigen::Vector3d& base, double radius, double height, int sides,
                 MaterialId material);
  // A trunk and a crown of `leaves` randomly turned triangles within an ellipsoid.
  void AddTree(const Eigen::Vector3d& base, double height, double crown_radius, int leaves,
               MaterialId bark, MaterialId foliage, RandomStream& random);
  // Treads and risers going up along `direction` (unit, horizontal) from the left front corner
  // `corner` of the lowest step, with an inclined underside; `width` extends to the right of the
  // direction.
  void AddStairs(const Eigen::Vector3d& corner, const Eigen::Vector3d& direction, double width,
                 int steps, double run, double rise, MaterialId material);

  TriangleMesh Finish() &&;

 private:
  TriangleMesh mesh_;
};

}  // namespace mlvi

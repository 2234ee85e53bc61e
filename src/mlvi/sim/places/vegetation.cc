// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/vegetation.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

Eigen::Vector3d InCube(RandomStream& random) {
  const double x = random.Uniform(-1.0, 1.0), y = random.Uniform(-1.0, 1.0),
               z = random.Uniform(-1.0, 1.0);
  return {x, y, z};
}

// A randomly turned, well-shaped triangle of `size` m.
void AddLeaf(MeshBuilder& builder, const Eigen::Vector3d& centre, double size, MaterialId material,
             RandomStream& random) {
  Eigen::Vector3d normal = InCube(random);
  if (normal.norm() < 0.05) normal = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d u = normal.normalized().unitOrthogonal();
  const Eigen::Vector3d v = normal.normalized().cross(u);
  const double stretch = random.Uniform(0.5, 1.0);
  builder.AddTriangle(centre - size * u, centre + size * u, centre + stretch * 1.6 * size * v,
                      material);
}

void AddBranch(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
               double radius, const TreeShape& shape, const PlantMaterials& m,
               RandomStream& random) {
  AddPipe(builder, from, to, radius, 0.35 * radius, 6, m.bark);
  const double spread = 0.32 * shape.crown + 0.2;
  for (int i = 0; i < shape.leaves_per_branch; ++i) {
    const double along = 0.45 + 0.6 * std::sqrt(random.Uniform());
    const Eigen::Vector3d centre = from + along * (to - from) + spread * InCube(random);
    AddLeaf(builder, centre, random.Uniform(0.06, 0.14), m.leaf, random);
  }
}

}  // namespace

void AddBranchedTree(MeshBuilder& builder, const Eigen::Vector3d& base, const TreeShape& shape,
                     const PlantMaterials& m, RandomStream& random) {
  const double radius = 0.022 * shape.height;
  const Eigen::Vector3d lean(random.Uniform(-0.04, 0.04), random.Uniform(-0.04, 0.04), 1.0);
  const Eigen::Vector3d top = base + 0.8 * shape.height * lean;
  AddPipe(builder, base - 0.2 * lean, top, radius, 0.3 * radius, 9, m.bark);
  const double first_angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
  for (int i = 0; i < shape.branches; ++i) {
    const double level = static_cast<double>(i) / shape.branches;
    const double height =
        shape.clear_trunk + level * (0.8 * shape.height - shape.clear_trunk) * 0.95;
    const double angle = first_angle + 2.4 * i + random.Uniform(-0.3, 0.3);  // golden angle
    const double reach = shape.crown * (1.0 - 0.5 * level) * random.Uniform(0.75, 1.0);
    const Eigen::Vector3d from = base + height * lean;
    const Eigen::Vector3d out(reach * std::cos(angle), reach * std::sin(angle),
                              reach * random.Uniform(0.25, 0.6));
    AddBranch(builder, from, from + out, 0.4 * radius, shape, m, random);
  }
  AddBranch(builder, top, top + Eigen::Vector3d(0.0, 0.0, 0.2 * shape.height), 0.3 * radius, shape,
            m, random);
}

void AddFoliage(MeshBuilder& builder, const Placement& place, const Eigen::Vector3d& size,
                int leaves, double leaf_size, MaterialId material, RandomStream& random) {
  for (int i = 0; i < leaves; ++i) {
    const Eigen::Vector3d p = 0.5 * InCube(random);
    AddLeaf(builder, place.At(p.x() * size.x(), p.y() * size.y(), (p.z() + 0.5) * size.z()),
            leaf_size * random.Uniform(0.6, 1.3), material, random);
  }
}

}  // namespace mlvi

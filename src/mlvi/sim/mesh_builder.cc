// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/mesh_builder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/sim/surface_looks.h"

namespace mlvi {
namespace {

// The sorted boundaries of a panel and its holes along one axis: the holes are unions of the cells
// between them.
std::vector<double> Boundaries(double size, const std::vector<PanelHole>& holes,
                               double PanelHole::*low, double PanelHole::*high) {
  std::vector<double> result = {0.0, size};
  for (const PanelHole& hole : holes) {
    result.push_back(hole.*low);
    result.push_back(hole.*high);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  MLVI_CHECK(result.front() == 0.0 && result.back() == size,
             "hole [{}, {}] outside of a panel of {} m", result.front(), result.back(), size);
  return result;
}

bool InAnyHole(double u, double v, const std::vector<PanelHole>& holes) {
  return std::any_of(holes.begin(), holes.end(), [&](const PanelHole& hole) {
    return u > hole.u0 && u < hole.u1 && v > hole.v0 && v < hole.v1;
  });
}

// A random triangle of about `size` m around `centre`.
std::array<Eigen::Vector3d, 3> Leaf(const Eigen::Vector3d& centre, double size,
                                    RandomStream& random) {
  const auto corner = [&]() -> Eigen::Vector3d {
    return centre + size * Eigen::Vector3d(random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0),
                                           random.Uniform(-1.0, 1.0));
  };
  const Eigen::Vector3d a = corner(), b = corner(), c = corner();
  return {a, b, c};
}

}  // namespace

MaterialId MeshBuilder::AddMaterial(const Material& material) {
  MLVI_CHECK(material.reflectivity >= 0.0 && material.reflectivity <= 1.0, "reflectivity {} of {}",
             material.reflectivity, material.name);
  MLVI_CHECK(material.transmission >= 0.0 && material.mirror >= 0.0 &&
                 material.lidar_mirror >= 0.0 &&
                 material.transmission + std::max(material.mirror, material.lidar_mirror) <= 1.0,
             "transmission {}, mirror {}, lidar_mirror {} of {}", material.transmission,
             material.mirror, material.lidar_mirror, material.name);
  MLVI_CHECK(material.tile > 0.0, "a tile of {} m of {}", material.tile, material.name);
  const bool smooth = material.transmission > 0.0 || material.lidar_mirror > 0.0;
  MLVI_CHECK(material.relief.plane() || !smooth, "relief on {}, which is smooth", material.name);
  MLVI_CHECK(material.relief.fine >= 0.0 && material.relief.fine_size > 0.0 &&
                 material.relief.coarse >= 0.0 && material.relief.coarse_size > 0.0,
             "relief {} m of {} m, {} m of {} m on {}", material.relief.fine,
             material.relief.fine_size, material.relief.coarse, material.relief.coarse_size,
             material.name);
  mesh_.materials.push_back(material);
  return static_cast<MaterialId>(mesh_.materials.size() - 1);
}

MaterialId MeshBuilder::AddMaterial(const std::string& name, double reflectivity) {
  return AddMaterial(UsualMaterial(name, reflectivity));
}

void MeshBuilder::AddTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& c, MaterialId material) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  for (const Eigen::Vector3d& p : {a, b, c}) mesh_.vertices.push_back(p.cast<float>());
  mesh_.triangles.push_back({first, first + 1, first + 2});
  mesh_.triangle_materials.push_back(material);
}

void MeshBuilder::AddTriangle(const std::array<Eigen::Vector3d, 3>& corners,
                              const std::array<Eigen::Vector2d, 3>& texture_coordinates,
                              MaterialId material) {
  // Those before without coordinates get zeros; Finish fills up those after.
  mesh_.texture_coordinates.resize(mesh_.vertices.size(), Eigen::Vector2f::Zero());
  AddTriangle(corners[0], corners[1], corners[2], material);
  for (const Eigen::Vector2d& uv : texture_coordinates)
    mesh_.texture_coordinates.push_back(uv.cast<float>());
}

TriangleMesh MeshBuilder::Finish() && {
  if (!mesh_.texture_coordinates.empty())
    mesh_.texture_coordinates.resize(mesh_.vertices.size(), Eigen::Vector2f::Zero());
  return std::move(mesh_);
}

void MeshBuilder::AddQuad(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& c, const Eigen::Vector3d& d, MaterialId material) {
  AddTriangle(a, b, c, material);
  AddTriangle(a, c, d, material);
}

void MeshBuilder::AddBox(const Eigen::Vector3d& base, const Eigen::Vector3d& size, double yaw,
                         MaterialId material) {
  const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto corner = [&](int i) -> Eigen::Vector3d {
    const Eigen::Vector3d local((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(),
                                i & 4 ? size.z() : 0.0);
    return base + R * local;
  };
  constexpr std::array<std::array<int, 4>, 6> kFaces = {
      {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}};
  for (const auto& f : kFaces)
    AddQuad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]), material);
}

void MeshBuilder::AddPanel(const PanelFrame& frame, MaterialId material,
                           const std::vector<PanelHole>& holes) {
  const Eigen::Vector3d inward = -frame.u.cross(frame.v);
  const auto at = [&](double u, double v, double depth = 0.0) -> Eigen::Vector3d {
    return frame.corner + u * frame.u + v * frame.v + depth * inward;
  };
  const auto us = Boundaries(frame.width, holes, &PanelHole::u0, &PanelHole::u1);
  const auto vs = Boundaries(frame.height, holes, &PanelHole::v0, &PanelHole::v1);
  for (std::size_t i = 0; i + 1 < us.size(); ++i) {
    for (std::size_t j = 0; j + 1 < vs.size(); ++j) {
      if (InAnyHole(0.5 * (us[i] + us[i + 1]), 0.5 * (vs[j] + vs[j + 1]), holes)) continue;
      AddQuad(at(us[i], vs[j]), at(us[i + 1], vs[j]), at(us[i + 1], vs[j + 1]),
              at(us[i], vs[j + 1]), material);
    }
  }
  for (const PanelHole& h : holes) {
    const double d = h.depth;
    const MaterialId reveal = h.reveal.value_or(material);
    if (d == 0.0) continue;  // a passage whose reveals belong to the wall on the other side
    AddQuad(at(h.u0, h.v0), at(h.u0, h.v1), at(h.u0, h.v1, d), at(h.u0, h.v0, d), reveal);
    AddQuad(at(h.u1, h.v0), at(h.u1, h.v1), at(h.u1, h.v1, d), at(h.u1, h.v0, d), reveal);
    AddQuad(at(h.u0, h.v0), at(h.u1, h.v0), at(h.u1, h.v0, d), at(h.u0, h.v0, d), reveal);
    AddQuad(at(h.u0, h.v1), at(h.u1, h.v1), at(h.u1, h.v1, d), at(h.u0, h.v1, d), reveal);
    if (h.open) continue;
    AddQuad(at(h.u0, h.v0, d), at(h.u1, h.v0, d), at(h.u1, h.v1, d), at(h.u0, h.v1, d), h.back);
  }
}

void MeshBuilder::AddColumn(const Eigen::Vector3d& base, double radius, double height, int sides,
                            MaterialId material) {
  const Eigen::Vector3d top = base + Eigen::Vector3d(0.0, 0.0, height);
  for (int i = 0; i < sides; ++i) {
    const auto rim = [&](int k) -> Eigen::Vector3d {
      const double angle = 2.0 * std::numbers::pi * k / sides;
      return {radius * std::cos(angle), radius * std::sin(angle), 0.0};
    };
    AddQuad(base + rim(i), base + rim(i + 1), top + rim(i + 1), top + rim(i), material);
    AddTriangle(top, top + rim(i), top + rim(i + 1), material);
  }
}

void MeshBuilder::AddTree(const Eigen::Vector3d& base, double height, double crown_radius,
                          int leaves, MaterialId bark, MaterialId foliage, RandomStream& random) {
  AddColumn(base, 0.04 * height, 0.6 * height, 10, bark);
  const Eigen::Vector3d centre = base + Eigen::Vector3d(0.0, 0.0, 0.7 * height);
  for (int i = 0; i < leaves;) {
    const Eigen::Vector3d p(random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0),
                            random.Uniform(-1.0, 1.0));
    if (p.squaredNorm() > 1.0) continue;
    const Eigen::Vector3d scale(crown_radius, crown_radius, 0.3 * height);
    const auto leaf = Leaf(centre + scale.cwiseProduct(p), 0.15, random);
    AddTriangle(leaf[0], leaf[1], leaf[2], foliage);
    ++i;
  }
}

void MeshBuilder::AddStairs(const Eigen::Vector3d& corner, const Eigen::Vector3d& direction,
                            double width, int steps, double run, double rise, MaterialId material) {
  const Eigen::Vector3d right = width * direction.cross(Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d up(0.0, 0.0, rise);
  for (int i = 0; i < steps; ++i) {
    const Eigen::Vector3d foot = corner + i * (run * direction + up), head = foot + up,
                          back = head + run * direction;
    AddQuad(foot, foot + right, head + right, head, material);
    AddQuad(head, head + right, back + right, back, material);
  }
  const Eigen::Vector3d slab(0.0, 0.0, -0.15), end = corner + steps * (run * direction + up);
  AddQuad(corner + slab, corner + slab + right, end + slab + right, end + slab, material);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

struct CrossSection {
  Eigen::Vector3d across;  // horizontal unless the bar is upright
  Eigen::Vector3d over;
};

CrossSection SectionOf(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  MLVI_CHECK((to - from).norm() > 1e-6, "a bar without length");
  const Eigen::Vector3d along = (to - from).normalized();
  const Eigen::Vector3d horizontal = along.cross(Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d across = horizontal.norm() > 1e-3
                                     ? horizontal.normalized()
                                     : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  return {across, across.cross(along)};
}

}  // namespace

Eigen::Vector3d Placement::Direction(double x, double y) const {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return {c * x - s * y, s * x + c * y, 0.0};
}

Eigen::Vector3d Placement::At(double x, double y, double z) const {
  return origin + Direction(x, y) + Eigen::Vector3d(0.0, 0.0, z);
}

Placement Placement::Within(double x, double y, double z, double turn) const {
  return {At(x, y, z), yaw + turn};
}

void AddBoxAt(MeshBuilder& builder, const Placement& place, const Eigen::Vector3d& base,
              const Eigen::Vector3d& size, MaterialId material) {
  builder.AddBox(place.At(base.x(), base.y(), base.z()), size, place.yaw, material);
}

void AddBeam(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double width, double height, MaterialId material) {
  const CrossSection section = SectionOf(from, to);
  const auto corner = [&](const Eigen::Vector3d& end, int i) -> Eigen::Vector3d {
    const double a = i == 0 || i == 3 ? -0.5 : 0.5, b = i < 2 ? -0.5 : 0.5;
    return end + a * width * section.across + b * height * section.over;
  };
  for (int i = 0; i < 4; ++i) {
    const int next = (i + 1) % 4;
    builder.AddQuad(corner(from, i), corner(from, next), corner(to, next), corner(to, i), material);
  }
  for (const Eigen::Vector3d& end : {from, to})
    builder.AddQuad(corner(end, 0), corner(end, 1), corner(end, 2), corner(end, 3), material);
}

void AddPipe(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             double radius_from, double radius_to, int sides, MaterialId material) {
  const CrossSection section = SectionOf(from, to);
  const auto rim = [&](int i) -> Eigen::Vector3d {
    const double angle = 2.0 * std::numbers::pi * (i % sides) / sides;
    return std::cos(angle) * section.across + std::sin(angle) * section.over;
  };
  for (int i = 0; i < sides; ++i) {
    const Eigen::Vector3d a = rim(i), b = rim(i + 1);
    builder.AddQuad(from + radius_from * a, from + radius_from * b, to + radius_to * b,
                    to + radius_to * a, material);
    builder.AddTriangle(from, from + radius_from * a, from + radius_from * b, material);
    builder.AddTriangle(to, to + radius_to * a, to + radius_to * b, material);
  }
}

void AddRailing(MeshBuilder& builder, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                double spacing, MaterialId material) {
  const Eigen::Vector3d rail(0.0, 0.0, 0.95);
  AddBeam(builder, from + rail, to + rail, 0.06, 0.05, material);
  const int gaps = std::max(1, static_cast<int>(std::lround((to - from).norm() / spacing)));
  for (int i = 0; i <= gaps; ++i) {
    const Eigen::Vector3d foot = from + (to - from) * (static_cast<double>(i) / gaps);
    AddBeam(builder, foot, foot + rail, 0.03, 0.03, material);
  }
}

void AddPolygon(MeshBuilder& builder, const std::vector<Eigen::Vector3d>& points,
                MaterialId material) {
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    builder.AddTriangle(points[0], points[i], points[i + 1], material);
}

void AddExtrusion(MeshBuilder& builder, const Placement& place,
                  const std::vector<Eigen::Vector2d>& profile, double half, MaterialId material) {
  std::vector<Eigen::Vector3d> left, right;
  for (const Eigen::Vector2d& p : profile) {
    left.push_back(place.At(p.x(), half, p.y()));
    right.push_back(place.At(p.x(), -half, p.y()));
  }
  AddPolygon(builder, left, material);
  AddPolygon(builder, right, material);
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const std::size_t next = (i + 1) % profile.size();
    builder.AddQuad(right[i], right[next], left[next], left[i], material);
  }
}

}  // namespace mlvi

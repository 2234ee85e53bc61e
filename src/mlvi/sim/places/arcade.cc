// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/arcade.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/sim/places/shapes.h"

namespace mlvi {
namespace {

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

// The wall above one opening of `width` m from `left` on, down to the arch.
void AddSpandrel(MeshBuilder& builder, const Eigen::Vector3d& left, const Eigen::Vector3d& along,
                 double width, const ArcadeStyle& style) {
  constexpr int kSegments = 10;
  const Eigen::Vector3d half = 0.5 * style.thickness * along.cross(kUp);
  const auto arch = [&](int i) -> Eigen::Vector3d {
    const double angle = std::numbers::pi * (1.0 - static_cast<double>(i) / kSegments);
    return left + 0.5 * width * (1.0 + std::cos(angle)) * along +
           (style.spring + style.rise * std::sin(angle)) * kUp;
  };
  for (int i = 0; i < kSegments; ++i) {
    const Eigen::Vector3d a = arch(i), b = arch(i + 1);
    const auto top = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return p + (left.z() + style.height - p.z()) * kUp;
    };
    for (const double side : {-1.0, 1.0}) {
      builder.AddQuad(a + side * half, b + side * half, top(b) + side * half, top(a) + side * half,
                      style.stone);
    }
    builder.AddQuad(a - half, b - half, b + half, a + half, style.stone);
  }
  const Eigen::Vector3d right = left + width * along, height = style.height * kUp;
  builder.AddQuad(left - half + height, right - half + height, right + half + height,
                  left + half + height, style.stone);
}

void AddInfill(MeshBuilder& builder, const Eigen::Vector3d& left, const Eigen::Vector3d& along,
               double width, const ArcadeStyle& style) {
  const Eigen::Vector3d right = left + width * along;
  if (style.parapet > 0.0) {
    AddBeam(builder, left + 0.5 * style.parapet * kUp, right + 0.5 * style.parapet * kUp,
            0.6 * style.thickness, style.parapet, style.stone);
  }
  if (!style.mullion) return;
  const Eigen::Vector3d middle = 0.5 * (left + right);
  AddPipe(builder, middle, middle + (style.spring + 0.9 * style.rise) * kUp, 0.07, 0.07, 8,
          style.stone);
  AddBeam(builder, left + style.spring * kUp, right + style.spring * kUp, 0.12, 0.12, style.stone);
}

}  // namespace

void AddArcade(MeshBuilder& builder, const Eigen::Vector3d& corner, const Eigen::Vector3d& along,
               double length, const ArcadeStyle& style, RandomStream& random) {
  const int bays = std::max(1, static_cast<int>(length / style.bay));
  const double bay = length / bays, yaw = std::atan2(along.y(), along.x());
  std::vector<double> half_widths;
  for (int i = 0; i <= bays; ++i)
    half_widths.push_back(0.5 * style.pier * random.Uniform(0.9, 1.1));
  for (int i = 0; i <= bays; ++i) {
    const Eigen::Vector3d foot = corner + i * bay * along;
    const double half = half_widths[static_cast<std::size_t>(i)];
    builder.AddBox(foot, {2.0 * half, style.thickness, style.height}, yaw, style.stone);
    builder.AddBox(foot, {2.0 * half + 0.1, style.thickness + 0.1, 0.3}, yaw, style.stone);
    builder.AddBox(foot + (style.spring - 0.15) * kUp,
                   {2.0 * half + 0.08, style.thickness + 0.08, 0.15}, yaw, style.stone);
    if (i == bays) break;
    const Eigen::Vector3d left = foot + half * along;
    const double width = bay - half - half_widths[static_cast<std::size_t>(i) + 1];
    AddSpandrel(builder, left, along, width, style);
    const auto& open = style.open_bays;
    if (std::find(open.begin(), open.end(), i) == open.end())
      AddInfill(builder, left, along, width, style);
  }
}

void AddBarrelVault(MeshBuilder& builder, const Eigen::Vector3d& corner,
                    const Eigen::Vector3d& along, double length, double width, double rise,
                    int segments, MaterialId material) {
  const Eigen::Vector3d right = along.cross(kUp);
  const auto at = [&](int i) -> Eigen::Vector3d {
    const double angle = std::numbers::pi * (1.0 - static_cast<double>(i) / segments);
    return corner + 0.5 * width * (1.0 + std::cos(angle)) * right + rise * std::sin(angle) * kUp;
  };
  for (int i = 0; i < segments; ++i) {
    builder.AddQuad(at(i), at(i + 1), at(i + 1) + length * along, at(i) + length * along, material);
  }
}

void AddTimberRoof(MeshBuilder& builder, const Eigen::Vector3d& corner,
                   const Eigen::Vector3d& along, double length, double width, double rise,
                   double spacing, const RoofMaterials& m, RandomStream& random) {
  const Eigen::Vector3d right = width * along.cross(kUp), end = length * along;
  const Eigen::Vector3d ridge = corner + 0.5 * right + rise * kUp;
  builder.AddQuad(corner, corner + end, ridge + end, ridge, m.boards);
  builder.AddQuad(corner + right, corner + right + end, ridge + end, ridge, m.boards);
  AddBeam(builder, ridge - 0.1 * kUp, ridge + end - 0.1 * kUp, 0.14, 0.2, m.beams);
  int index = 0;
  for (double s = 0.5 * spacing; s < length; s += spacing * random.Uniform(0.94, 1.06), ++index) {
    const Eigen::Vector3d at = s * along - 0.08 * kUp;
    AddBeam(builder, corner + at, ridge + at, 0.1, 0.14, m.beams);
    AddBeam(builder, corner + right + at, ridge + at, 0.1, 0.14, m.beams);
    if (index % 3 != 1) continue;
    const Eigen::Vector3d low = corner + at + 0.05 * kUp, post = ridge + at;
    AddBeam(builder, low, low + right, 0.14, 0.2, m.beams);
    AddBeam(builder, low + 0.5 * right, post, 0.12, 0.12, m.beams);
  }
}

}  // namespace mlvi

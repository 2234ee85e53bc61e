// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/theatre.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"

namespace mlvi {
namespace {

constexpr double kRadius = kTheatreRadius, kFront = kTheatreFront, kCeiling = kTheatreCeiling;
constexpr int kSectors = 24;

Eigen::Vector3d Polar(double radius, double angle, double z) {
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}
double AngleOf(int sector) { return std::numbers::pi * sector / kSectors; }

struct Ring {
  double radius0, radius1, z0, z1;
};

// The surface swept by a straight line in the half plane through the axis, over sectors
// [first, last).
void AddRing(MeshBuilder& builder, const Ring& ring, int first, int last, MaterialId material) {
  for (int i = first; i < last; ++i) {
    const double a = AngleOf(i), b = AngleOf(i + 1);
    builder.AddQuad(Polar(ring.radius0, a, ring.z0), Polar(ring.radius0, b, ring.z0),
                    Polar(ring.radius1, b, ring.z1), Polar(ring.radius1, a, ring.z1), material);
  }
}

// Outer wall and ceiling; the straight east wall has the open door of a gallery.
void AddShell(MeshBuilder& builder, double door_height, const Palette& m) {
  AddRing(builder, {kRadius, kRadius, 0.0, kCeiling}, 0, kSectors, m.plaster);
  for (int i = 2; i < kSectors; i += 4) {  // tall windows above the upper gallery
    const double angle = AngleOf(i) + 0.5 * AngleOf(1);
    builder.AddBox(Polar(kRadius - 0.1, angle, kUpperGallery + 1.6), {0.1, 1.1, 2.4}, angle,
                   m.window);
  }
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  builder.AddPanel({{kRadius, kFront, 0.0}, -x, z, 2.0 * kRadius, kCeiling}, m.plaster,
                   {Door(4.0, m.dark_wood, m.frame, 0.3), Door(17.0, m.dark_wood, m.frame, 0.3)});
  builder.AddPanel({{kRadius, 0.0, 0.0}, -y, z, -kFront, kCeiling}, m.plaster,
                   {{.u0 = -kGalleryDoor - 0.55,
                     .u1 = -kGalleryDoor + 0.55,
                     .v0 = door_height,
                     .v1 = door_height + 2.2,
                     .depth = 0.3,
                     .open = true}});
  builder.AddPanel({{-kRadius, kFront, 0.0}, y, z, -kFront, kCeiling}, m.plaster);
  builder.AddPanel({{-kRadius, kFront, 0.0}, x, y, 2.0 * kRadius, kRadius - kFront}, m.floorboards);
  builder.AddPanel({{-kRadius, kFront, kCeiling}, x, y, 2.0 * kRadius, kRadius - kFront},
                   m.posters);
}

// The straight parts of a gallery along the side walls.
void AddGallerySides(MeshBuilder& builder, double floor, double inner, const Palette& m) {
  const double width = kRadius - inner;
  for (const double side : {-1.0, 1.0}) {
    const double x = side * (inner + 0.5 * width);
    builder.AddBox({x, 0.5 * kFront, floor - 0.35}, {width, -kFront, 0.35}, 0.0, m.floorboards);
    builder.AddBox({side * inner, 0.5 * kFront, floor - 0.35}, {0.1, -kFront, 1.2}, 0.0,
                   m.dark_wood);
    for (const double row : {0.4, 1.15})
      builder.AddBox({side * (inner + row), 0.5 * kFront - 1.2, floor}, {0.5, -kFront - 2.6, 0.44},
                     0.0, m.wood);
  }
}

// Benches in tiers: their backs and seats are swept shapes, broken by aisles.
void AddGallery(MeshBuilder& builder, double floor, double inner, const Palette& m,
                RandomStream& random) {
  AddGallerySides(builder, floor, inner, m);
  AddRing(builder, {inner, kRadius, floor, floor}, 0, kSectors, m.floorboards);
  AddRing(builder, {inner, inner, floor - 0.35, floor + 0.85}, 0, kSectors, m.dark_wood);
  AddRing(builder, {inner, kRadius, floor - 0.35, floor - 0.35}, 0, kSectors, m.ceiling);
  for (int tier = 0; tier < 2; ++tier) {
    const double r = inner + 0.35 + 0.75 * tier;
    for (int i = 0; i < kSectors; i += 2) {
      if (i % 6 == 4) continue;  // an aisle
      const int end = random.Uniform() < 0.85 ? i + 2 : i + 1;
      AddRing(builder, {r, r + 0.38, floor + 0.42, floor + 0.42}, i, end, m.wood);
      AddRing(builder, {r + 0.42, r + 0.42, floor, floor + 0.85}, i, end, m.dark_wood);
      AddRing(builder, {r, r, floor, floor + 0.42}, i, end, m.dark_wood);
    }
  }
  for (int i = 2; i < kSectors; i += 4) {
    const Eigen::Vector3d head = Polar(inner + 0.12, AngleOf(i), floor - 0.35);
    const Eigen::Vector3d foot = Polar(inner + 0.12, AngleOf(i), std::max(0.0, floor - 3.6));
    AddPipe(builder, foot, head, 0.13, 0.11, 12, m.white_metal);
  }
}

// The floor of the theatre: chairs, the organ, a throne's canopy.
void AddFloor(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (double y = -2.5; y < 3.0; y += 1.0) {
    for (double x = -4.0; x < 4.5; x += 0.62) {
      if (random.Uniform() < 0.2 || std::abs(x) < 0.6) continue;
      AddChair(builder, {{x, y + random.Uniform(-0.05, 0.05), 0.0}, std::numbers::pi}, m);
    }
  }
  builder.AddBox({0.0, kFront + 0.6, 0.0}, {4.2, 1.2, 3.2}, 0.0, m.dark_wood);
  for (double x = -1.9; x < 2.0; x += 0.19) {
    const double height = 3.4 + 1.6 * std::abs(std::cos(1.6 * x)) + random.Uniform(-0.05, 0.05);
    AddPipe(builder, {x, kFront + 1.0, 3.2}, {x, kFront + 1.0, 3.2 + height}, 0.075, 0.075, 8,
            m.metal);
  }
}

}  // namespace

void AddTheatre(MeshBuilder& builder, double door_height, const Palette& m, RandomStream& random) {
  AddShell(builder, door_height, m);
  AddGallery(builder, kLowerGallery, 7.0, m, random);
  AddGallery(builder, kUpperGallery, 7.5, m, random);
  AddFloor(builder, m, random);
}

std::vector<Eigen::Vector3d> GalleryWalk(double radius, double height, double angle, bool back) {
  std::vector<Eigen::Vector3d> points = {{kRadius + 0.15, kGalleryDoor, height},
                                         {radius, kGalleryDoor + 0.2, height}};
  const int steps = std::max(1, static_cast<int>(std::lround(8.0 * angle)));
  for (int i = 0; i <= steps; ++i) points.push_back(Polar(radius, angle * i / steps, height));
  if (back) std::reverse(points.begin(), points.end());
  return points;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/value_noise.h"

namespace mlvi {
namespace {

// A gallery of the mine between two points of its floor.
struct Gallery {
  Eigen::Vector3d from, to;
  double half_width = 1.4;  // m
  double height = 2.5;      // m
  bool sawn = false;        // smooth walls and roof
};

// A round trip (the walk) with dead ends off it.
const std::vector<Gallery>& Galleries() {
  static const std::vector<Gallery> galleries = {
      {{0.0, 0.0, 0.0}, {14.0, 1.5, -0.2}, 1.4, 2.5, true},
      {{14.0, 1.5, -0.2}, {22.0, 8.0, -0.6}, 1.6, 2.7},
      {{22.0, 8.0, -0.6}, {23.0, 20.0, -1.0}, 1.3},
      {{23.0, 20.0, -1.0}, {13.0, 26.0, -0.8}, 1.5},
      {{13.0, 26.0, -0.8}, {2.0, 23.0, -0.5}, 1.3, 2.4},
      {{2.0, 23.0, -0.5}, {-4.0, 13.0, -0.2}, 1.4},
      {{-4.0, 13.0, -0.2}, {0.0, 0.0, 0.0}, 1.5},
      {{14.0, 1.5, -0.2}, {13.0, 26.0, -0.8}, 1.3, 2.4, true},  // the cross-cut
      {{0.0, 0.0, 0.0}, {-9.0, -3.0, 0.1}, 1.3},
      {{22.0, 8.0, -0.6}, {30.0, 6.0, -0.6}, 1.4},
      {{23.0, 20.0, -1.0}, {29.0, 26.0, -1.2}, 1.2, 2.2},
      {{2.0, 23.0, -0.5}, {-3.0, 30.0, -0.3}, 1.3},
      {{13.8, 12.0, -0.5}, {6.0, 12.5, -0.4}, 1.2, 2.3},
  };
  return galleries;
}

// Distance to the nearest gallery: a tunnel of rounded rectangular section that stands on the line
// between its ends.
double GalleryDistance(const Eigen::Vector3d& p, const Gallery& g) {
  const Eigen::Vector2d a = g.from.head<2>(), b = g.to.head<2>(), q = p.head<2>();
  const double t = std::clamp((q - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  const double across = (q - (a + t * (b - a))).norm();
  const double above = p.z() - (1.0 - t) * g.from.z() - t * g.to.z();
  // The roof is an arch: lower towards the walls.
  const double roof = g.height - 0.25 * across * across;
  const double outside = across - g.half_width;
  return std::max({outside, above - roof, -above});
}

// How rough the rock is at a point: sawn galleries are smooth but for their first and last metre.
double Roughness(const Eigen::Vector3d& p) {
  double roughness = 1.0;
  for (const Gallery& g : Galleries()) {
    if (!g.sawn) continue;
    const Eigen::Vector2d a = g.from.head<2>(), along = g.to.head<2>() - a;
    const double length = along.norm(), s = (p.head<2>() - a).dot(along) / length;
    const double across =
        std::abs((p.x() - a.x()) * along.y() - (p.y() - a.y()) * along.x()) / length;
    const double inside = std::clamp(std::min(s, length - s) - 1.0, 0.0, 1.0),
                 near = std::clamp((g.half_width + 0.9 - across) / 0.4, 0.0, 1.0);
    roughness = std::min(roughness, 1.0 - 0.95 * inside * near);
  }
  return roughness;
}

double RockDistance(const Eigen::Vector3d& p, const ValueNoise& noise) {
  double distance = 1e9;
  for (const Gallery& g : Galleries()) distance = std::min(distance, GalleryDistance(p, g));
  // Blocks and cracks: rough walls and roof, a floor that has been walked on.
  const double walls = std::clamp((p.z() + 1.0) / 1.2, 0.25, 1.0);
  return distance + Roughness(p) * walls * (0.2 * noise.At(1.1 * p) + 0.11 * noise.At(2.7 * p));
}

bool InAnotherGallery(const Eigen::Vector3d& point, std::size_t own) {
  for (std::size_t i = 0; i < Galleries().size(); ++i) {
    if (i != own && GalleryDistance(point, Galleries()[i]) < 0.4) return true;
  }
  return false;
}

// Timber sets every few metres, a rail, a pipe along one wall, rubble at the sides.
void AddWorks(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (std::size_t i = 0; i < Galleries().size(); ++i) {
    const Gallery& g = Galleries()[i];
    if (g.sawn) continue;
    const double length = (g.to - g.from).norm();
    const Eigen::Vector3d along = (g.to - g.from) / length;
    const Eigen::Vector3d left = up.cross(along).normalized();
    for (double s = random.Uniform(2.5, 5.0); s < length - 2.0; s += random.Uniform(3.0, 8.0)) {
      const Eigen::Vector3d foot = g.from + s * along;
      const double half = g.half_width - 0.15;
      const Eigen::Vector3d knee = foot + 0.5 * up;
      if (InAnotherGallery(knee + half * left, i) || InAnotherGallery(knee - half * left, i))
        continue;
      if (random.Uniform() < 0.45) {
        for (const double side : {-1.0, 1.0}) {
          AddPipe(builder, foot + side * half * left - 0.2 * up,
                  foot + side * (half - 0.1) * left + 2.05 * up, 0.1, 0.09, 8, m.wood);
        }
        AddPipe(builder, foot - half * left + 2.1 * up, foot + half * left + 2.1 * up, 0.1, 0.1, 8,
                m.wood);
      } else {
        AddClutter(builder, {foot + (random.Uniform() < 0.5 ? -1.0 : 1.0) * half * left - 0.1 * up},
                   0.25, 3, m, random);
      }
    }
    if (i % 3 == 0) {
      const Eigen::Vector3d at = (g.half_width - 0.12) * left + 1.7 * up;
      AddPipe(builder, g.from + 2.0 * along + at, g.to - 2.0 * along + at, 0.06, 0.06, 8, m.rust);
    }
  }
}

}  // namespace

Place MakeMine(std::uint64_t seed) {
  RandomStream random(seed, "mine");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const ValueNoise noise(random.NextBits());
  AddIsosurface(
      builder, {-12.0, -6.0, -2.0}, {33.0, 33.0, 3.6}, 0.2,
      [&](const Eigen::Vector3d& p) { return RockDistance(p, noise); }, m.rock);
  AddWorks(builder, m, random);
  // The round trip, then the cross-cut from the other side.
  WalkingPath path = WalkAt(kHandheldHeight - 0.15,
                            {{1.5, 0.16, 0.0},
                             {14.0, 1.5, -0.2},
                             {22.0, 8.0, -0.6},
                             {23.0, 20.0, -1.0},
                             {13.0, 26.0, -0.8},
                             {2.0, 23.0, -0.5},
                             {-4.0, 13.0, -0.2},
                             {0.0, 0.2, 0.0},
                             {14.0, 1.7, -0.2},
                             {13.0, 26.0, -0.8},
                             {2.0, 23.0, -0.5},
                             {-4.0, 13.0, -0.2},
                             {-0.1, 0.3, 0.0}},
                            0.6);
  return {.world = World(std::move(builder).Finish(), CarriedLamp(60.0)), .path = std::move(path)};
}

}  // namespace mlvi

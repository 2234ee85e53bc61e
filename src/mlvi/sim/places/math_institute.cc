// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/value_noise.h"
#include "mlvi/sim/places/vegetation.h"
#include "mlvi/sim/places/vehicles.h"

namespace mlvi {
namespace {

// A plaza in the south, the institute with an arcade in front and a passage under it, a court
// behind. The wing's front is at y = 0, the court begins at y = kDepth.
constexpr double kHalf = 24.0;                      // m, half the width of the site
constexpr double kDepth = 12.0, kCourtEnd = 34.0;   // m, of the wing and of the court
constexpr double kPlazaEnd = -22.0;                 // m
constexpr double kPassage = 1.9, kPassageX = -4.0;  // m, half width and middle of the passage
constexpr double kArcade = 3.0;                     // m, depth of the arcade before the front

FacadeStyle GlassFront(const Palette& m) {
  return {.wall = m.stone,
          .window = m.window,
          .door = m.dark_glass,
          .trim = m.metal,
          .height = 14.0,
          .storey = 3.8,
          .bay = 2.6,
          .window_width = 2.0,
          .window_height = 2.6,
          .missing = 0.05,
          .doors = 2};
}

// The wing: two long fronts pierced by the passage, and the passage itself.
void AddWing(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const double u = kHalf + kPassageX;
  AddFacade(builder, {-kHalf, 0.0, 0.0}, x, 2.0 * kHalf, GlassFront(m),
            {Passage(u - kPassage, u + kPassage, 3.6)}, random);
  FacadeStyle back = GlassFront(m);
  back.wall = m.concrete;
  back.bay = 3.9;
  AddFacade(builder, {kHalf, kDepth, 0.0}, -x, 2.0 * kHalf, back,
            {Passage(2.0 * kHalf - u - kPassage, 2.0 * kHalf - u + kPassage, 3.6)}, random);
  const double west = kPassageX - kPassage, east = kPassageX + kPassage;
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  builder.AddPanel(
      {{west, 0.0, -0.3}, y, z, kDepth, 3.9}, m.stone,
      {{3.0, 4.2, 0.3, 2.5, 0.2, false, m.door}, {7.0, 9.0, 1.0, 2.8, 0.3, false, m.window}});
  builder.AddPanel({{east, kDepth, -0.3}, -y, z, kDepth, 3.9}, m.stone,
                   {{2.2, 3.4, 0.3, 2.5, 0.25, false, m.door}});
  builder.AddPanel({{west, 0.0, 3.6}, x, y, 2.0 * kPassage, kDepth}, m.ceiling);
  for (double v = 1.5; v < kDepth; v += 3.1)
    builder.AddBox({kPassageX, v, 3.52}, {1.2, 0.2, 0.08}, 0.0, m.lamp);
}

// Slender columns under a concrete canopy.
void AddArcadeOfColumns(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (double x = -kHalf + 1.0; x < kHalf; x += 3.9) {
    if (std::abs(x - kPassageX) < 1.5) continue;
    builder.AddColumn({x + random.Uniform(-0.05, 0.05), -kArcade, -0.3}, 0.22, 4.4, 14, m.concrete);
  }
  builder.AddBox({0.0, -0.5 * kArcade - 0.2, 4.1}, {2.0 * kHalf, kArcade + 0.8, 0.35}, 0.0,
                 m.concrete);
}

void AddSurroundings(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  FacadeStyle brick = GlassFront(m);
  brick.wall = m.brick;
  brick.height = 10.0;
  brick.bay = 3.3;
  brick.window_width = 1.2;
  brick.window_height = 1.8;
  brick.missing = 0.2;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  AddFacade(builder, {kHalf, kPlazaEnd, 0.0}, -x, 2.0 * kHalf, brick, {}, random);
  AddFacade(builder, {-kHalf, kPlazaEnd, 0.0}, y, -kPlazaEnd, brick, {}, random);
  FacadeStyle wall = brick;
  wall.height = 3.0;  // a garden wall without windows
  wall.doors = 1;
  AddFacade(builder, {kHalf, 0.0, 0.0}, -y, -kPlazaEnd, wall, {}, random);
  FacadeStyle court = GlassFront(m);
  court.wall = m.plaster;
  court.height = 11.0;
  AddFacade(builder, {-kHalf, kDepth, 0.0}, y, kCourtEnd - kDepth, court, {}, random);
  AddFacade(builder, {-kHalf, kCourtEnd, 0.0}, x, 2.0 * kHalf, brick, {}, random);
  AddFacade(builder, {kHalf, kCourtEnd, 0.0}, -y, kCourtEnd - kDepth, court, {}, random);
}

// Glass crystals that light the rooms under the court, bicycles, trees, benches, bollards.
void AddThings(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const auto crystal = [&](const Eigen::Vector3d& base, double radius, double height) {
    const Eigen::Vector3d top = base + Eigen::Vector3d(0.3 * radius, 0.1, height);
    for (int i = 0; i < 5; ++i) {
      const auto rim = [&](int k) -> Eigen::Vector3d {
        const double angle = 1.2566 * (k % 5) + 0.3;
        return base + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      };
      builder.AddTriangle(rim(i), rim(i + 1), top, m.glass);
      AddBeam(builder, rim(i), top, 0.08, 0.08, m.metal);
      AddBeam(builder, rim(i), rim(i + 1), 0.15, 0.3, m.metal);
    }
  };
  crystal({4.0, 24.0, 0.0}, 2.2, 3.4);
  crystal({-14.0, 21.0, 0.0}, 1.8, 2.6);
  for (double x = -20.0; x < -9.0; x += random.Uniform(0.5, 0.9))
    AddBicycle(builder, {{x, 32.6, 0.0}, 1.57 + random.Uniform(-0.15, 0.15)}, m);
  const PlantMaterials plants{m.bark, m.leaf};
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(-14.0, -13.0), Eigen::Vector2d(3.0, -16.5),
                                    Eigen::Vector2d(16.0, -12.0), Eigen::Vector2d(16.5, 28.0)}) {
    AddBranchedTree(builder, {at.x(), at.y(), 0.0},
                    {.height = random.Uniform(5.5, 8.0), .crown = random.Uniform(1.6, 2.3)}, plants,
                    random);
    builder.AddBox({at.x(), at.y(), -0.1}, {1.6, 1.6, 0.5}, 0.1, m.concrete);
  }
  AddBench(builder, {{-8.0, -14.0, 0.0}, 0.4}, m);
  AddBench(builder, {{10.0, 30.5, 0.0}, 0.0}, m);
  for (double x = -20.0; x < 21.0; x += 4.0)
    builder.AddColumn({x, kPlazaEnd + 2.0, -0.1}, 0.1, 1.0, 10, m.metal);
  AddVan(builder, {{18.5, -18.0, 0.0}, 3.3}, m.white_metal, m);
}

std::vector<MovingObject> Walkers(RandomStream& random) {
  std::vector<MovingObject> walkers;
  walkers.push_back(MakePedestrian(
      "lecturer", ThereAndBack({-18.0, -18.0, 0.0}, {14.0, -18.5, 0.0}, 0.9, 1.4, 3.0), random));
  walkers.push_back(MakePedestrian(
      "student", ThereAndBack({18.0, 14.0, 0.0}, {18.5, 31.0, 0.0}, 0.8, 1.2, 0.0), random));
  walkers.push_back(MakePedestrian(
      "other student", ThereAndBack({19.5, -3.5, 0.0}, {19.0, -15.0, 0.0}, 0.8, 1.1, 6.0), random));
  return walkers;
}

}  // namespace

Place MakeMathInstitute(std::uint64_t seed) {
  RandomStream random(seed, "math institute");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const ValueNoise bumps(random.NextBits());
  const HeightField ground = [&](double x, double y) {
    return 0.02 * bumps.At({0.4 * x, 0.4 * y, 0.0});
  };
  AddWing(builder, m, random);
  AddArcadeOfColumns(builder, m, random);
  AddSurroundings(builder, m, random);
  AddThings(builder, m, random);
  AddTerrain(builder, {-kHalf, kPlazaEnd}, {kHalf, kCourtEnd}, 1.0, ground, m.flagstone);
  const double p = kPassageX;
  WalkingPath path =
      WalkAt(kHandheldHeight,
             {{-16.0, -6.0, 0.0},  {-12.0, -5.0, 0.0},   {p - 4.0, -1.7, 0.0}, {p - 0.4, -1.4, 0.0},
              {p - 0.2, 1.5, 0.0}, {p - 0.3, 12.5, 0.0}, {p + 1.0, 16.5, 0.0}, {11.0, 18.0, 0.0},
              {11.0, 27.5, 0.0},   {-4.0, 29.5, 0.0},    {-7.0, 18.0, 0.0},    {p + 0.4, 12.5, 0.0},
              {p + 0.2, 1.5, 0.0}, {p + 0.4, -1.3, 0.0}, {p + 3.0, -1.6, 0.0}, {14.0, -1.5, 0.0},
              {14.1, -6.5, 0.0},   {4.0, -11.0, 0.0},    {-15.0, -10.0, 0.0},  {-19.0, -8.0, 0.0}},
             0.6);
  return {.world = World(std::move(builder).Finish(), Overcast(), Walkers(random)),
          .path = std::move(path)};
}

}  // namespace mlvi

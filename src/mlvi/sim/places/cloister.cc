// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/arcade.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/value_noise.h"
#include "mlvi/sim/places/vegetation.h"

namespace mlvi {
namespace {

// Four walks around a court; the middle of the arcades' walls is at kInner.
constexpr double kOuter = 17.0, kInner = 13.2;  // m, half the sides
constexpr double kEaves = 3.7;                  // m

// Along the side that `side` quarter turns lead to from the south, anticlockwise.
Placement Side(int side) { return {Eigen::Vector3d::Zero(), 0.5 * std::numbers::pi * side}; }

void AddArcades(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (int side = 0; side < 4; ++side) {
    const Placement place = Side(side);
    const ArcadeStyle style{.stone = m.old_stone,
                            .bay = 2.9,
                            .pier = 0.7,
                            .thickness = 0.55,
                            .spring = 1.9,
                            .rise = 1.05,
                            .height = kEaves + 0.1,
                            .parapet = 0.55,
                            .mullion = true,
                            .open_bays = {side == 0 ? 4 : 2 + side}};
    AddArcade(builder, place.At(-kInner, -kInner), place.Direction(1.0, 0.0), 2.0 * kInner, style,
              random);
    // The strip of the roof lies to the right of the way round the court.
    AddTimberRoof(builder, place.At(-kOuter, -kInner, kEaves), place.Direction(1.0, 0.0),
                  2.0 * kOuter, kOuter - kInner, 1.9, 1.1, {m.dark_wood, m.wood}, random);
  }
}

// The walls outside the walks: nearly bare, a few memorial tablets, a door.
void AddOuterWalls(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (int side = 0; side < 4; ++side) {
    const Placement place = Side(side);
    std::vector<PanelHole> holes;
    const double u = random.Uniform(6.0, 28.0);
    if (side != 2) holes.push_back({u, u + 1.3, 0.3, 2.7, 0.5, false, m.dark_wood});
    builder.AddPanel({.corner = place.At(kOuter, -kOuter, -0.3),
                      .u = place.Direction(-1.0, 0.0),
                      .width = 2.0 * kOuter,
                      .height = kEaves + 0.3},
                     m.old_stone, holes);
    for (double x = random.Uniform(3.0, 9.0) - kOuter; x < kOuter - 2.0;
         x += random.Uniform(4.0, 11.0)) {
      if (!holes.empty() && std::abs(kOuter - x - u - 0.65) < 1.6) continue;
      AddPicture(builder, place.Within(x, -kOuter + 0.03, random.Uniform(1.0, 1.7)),
                 random.Uniform(0.4, 0.9), random.Uniform(0.4, 1.1), m.plaster);
    }
  }
  AddBench(builder, Side(1).Within(3.0, -kOuter + 0.4), m);
  AddBench(builder, Side(3).Within(-6.0, -kOuter + 0.4), m);
}

// What one sees through the arches: the lawn, an old oak, the chapel behind the south walk.
void AddCourt(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const ValueNoise bumps(random.NextBits());
  AddTerrain(
      builder, {-kInner, -kInner}, {kInner, kInner}, 0.8,
      [&](double x, double y) {
        return 0.06 * bumps.At({0.4 * x, 0.4 * y, 0.0}) - 0.08;
      },
      m.grass);
  AddBranchedTree(
      builder, {6.0, 5.0, -0.1},
      {.height = 13.0, .crown = 5.0, .clear_trunk = 2.4, .branches = 16, .leaves_per_branch = 160},
      {m.bark, m.leaf}, random);
  builder.AddColumn({-4.0, -3.0, -0.1}, 0.7, 0.9, 12, m.stone);
  const FacadeStyle chapel{.wall = m.stone,
                           .window = m.window,
                           .door = m.dark_wood,
                           .trim = m.stone,
                           .height = 17.0,
                           .storey = 14.0,
                           .bay = 6.0,
                           .window_width = 2.6,
                           .window_height = 8.0,
                           .buttress = 1.0,
                           .doors = 0};
  AddFacade(builder, {kOuter + 2.0, -kOuter - 1.5, 0.0}, -Eigen::Vector3d::UnitX(),
            2.0 * kOuter + 4.0, chapel, {}, random);
}

}  // namespace

Place MakeCloister(std::uint64_t seed) {
  RandomStream random(seed, "cloister");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddArcades(builder, m, random);
  AddOuterWalls(builder, m, random);
  AddCourt(builder, m, random);
  const double walk = 0.5 * (kOuter + kInner);
  for (int side = 0; side < 4; ++side) {
    const Placement place = Side(side);
    builder.AddPanel({.corner = place.At(-kOuter, -kOuter),
                      .u = place.Direction(1.0, 0.0),
                      .v = place.Direction(0.0, 1.0),
                      .width = kOuter + kInner,
                      .height = kOuter - kInner},
                     m.flagstone);
  }
  return {.world = World(std::move(builder).Finish(), Overcast()),
          .path = WalkAt(kHandheldHeight,
                         {{-8.0, -walk, 0.0},
                          {walk, -walk, 0.0},
                          {walk, walk, 0.0},
                          {-walk, walk, 0.0},
                          {-walk, -walk, 0.0}},
                         0.7)};
}

}  // namespace mlvi

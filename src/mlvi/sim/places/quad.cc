// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/value_noise.h"
#include "mlvi/sim/places/vegetation.h"

namespace mlvi {
namespace {

constexpr double kEast = 22.0, kNorth = 18.0;  // m, half the sides of the quadrangle
constexpr double kGate = 2.0;                  // m, half the width of the gateway in the south
constexpr double kTower = 3.0;                 // m that the gate tower stands out into the quad

void AddWalls(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const FacadeStyle old{.wall = m.old_stone,
                        .window = m.window,
                        .door = m.dark_wood,
                        .trim = m.stone,
                        .height = 11.0,
                        .storey = 3.5,
                        .bay = 3.4,
                        .doors = 2};
  FacadeStyle chapel = old, hall = old, lodgings = old;
  chapel.height = 14.0;
  chapel.storey = 11.0;
  chapel.bay = 5.2;
  chapel.window_width = 2.4;
  chapel.window_height = 7.5;
  chapel.buttress = 0.8;
  chapel.missing = 0.0;
  hall.wall = m.stone;
  hall.height = 12.5;
  hall.bay = 4.3;
  hall.window_width = 1.8;
  lodgings.wall = m.plaster;
  lodgings.missing = 0.25;
  const std::vector<PanelHole> gate = {{.u0 = kEast - kGate,
                                        .u1 = kEast + kGate,
                                        .v0 = 0.0,
                                        .v1 = 4.0,
                                        .depth = 6.0,
                                        .back = m.dark_wood}};
  AddFacades(builder, {-kEast, -kNorth, 0.0}, {2.0 * kEast, 2.0 * kNorth}, true,
             {old, hall, chapel, lodgings}, {gate}, random);
}

// Piers of the tower either side of the gateway, and the tower above.
void AddGateTower(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const double y = -kNorth + 0.5 * kTower;
  for (const double side : {-1.0, 1.0})
    builder.AddBox({side * (kGate + 1.1), y, -0.3}, {1.6, kTower, 5.0}, 0.0, m.old_stone);
  builder.AddBox({0.0, y, 4.5}, {2.0 * kGate + 3.8, kTower, 12.0}, 0.0, m.old_stone);
  for (const double z : {7.0, 10.5}) {
    for (const double x : {-1.3, 1.3}) {
      builder.AddBox({x, -kNorth + kTower, z + random.Uniform(-0.1, 0.1)}, {0.9, 0.12, 1.8}, 0.0,
                     m.window);
    }
  }
  for (double x = -3.6; x < 3.7; x += 1.2)  // battlements
    builder.AddBox({x, -kNorth + kTower - 0.2, 16.5}, {0.7, 0.4, 0.9}, 0.0, m.old_stone);
}

void AddGarden(MeshBuilder& builder, const Palette& m, const HeightField& height,
               RandomStream& random) {
  const PlantMaterials plants{m.bark, m.leaf};
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(17.5, 13.0), Eigen::Vector2d(-17.3, -13.5), Eigen::Vector2d(-18.0, 12.0)}) {
    AddBranchedTree(builder, {at.x(), at.y(), height(at.x(), at.y())},
                    {.height = random.Uniform(7.0, 10.0), .crown = random.Uniform(2.0, 2.8)},
                    plants, random);
  }
  for (double x = -19.0; x < 20.0; x += random.Uniform(1.8, 4.5)) {  // borders along two walls
    if (std::abs(x) < 5.5) continue;
    for (const double y : {-kNorth + 0.7, kNorth - 1.3}) {
      AddFoliage(builder, {{x, y, 0.0}, random.Uniform(-0.2, 0.2)},
                 {random.Uniform(0.8, 1.8), 0.8, random.Uniform(0.5, 1.6)}, 130, 0.07, m.leaf,
                 random);
    }
  }
  for (const Eigen::Vector3d& b :
       {Eigen::Vector3d(8.0, 16.0, 0.0), Eigen::Vector3d(-6.5, 16.1, 0.05),
        Eigen::Vector3d(20.3, -4.0, -1.57), Eigen::Vector3d(-20.2, 3.0, 1.6)})
    AddBench(builder, {{b.x(), b.y(), 0.0}, b.z()}, m);
  // The statue in the middle of the lawn, on steps.
  for (int step = 0; step < 3; ++step)
    builder.AddColumn({1.0, 0.5, 0.15 * step}, 1.5 - 0.35 * step, 0.25, 8, m.stone);
  builder.AddBox({1.0, 0.5, 0.5}, {0.9, 0.9, 1.3}, 0.4, m.stone);
  AddPipe(builder, {1.0, 0.5, 1.8}, {1.05, 0.5, 3.2}, 0.32, 0.18, 9, m.metal);
  AddPipe(builder, {1.05, 0.5, 2.9}, {1.5, 0.7, 3.4}, 0.09, 0.06, 7, m.metal);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(12.0, 8.5), Eigen::Vector2d(-12.3, -8.2)}) {
    AddPipe(builder, {at.x(), at.y(), -0.2}, {at.x(), at.y(), 3.6}, 0.07, 0.05, 8, m.metal);
    builder.AddBox({at.x(), at.y(), 3.6}, {0.35, 0.35, 0.5}, 0.0, m.lamp);
  }
}

std::vector<MovingObject> Walkers(RandomStream& random) {
  std::vector<MovingObject> walkers;
  walkers.push_back(MakePedestrian(
      "student", ThereAndBack({-16.0, 15.2, 0.0}, {16.0, 14.8, 0.0}, 0.8, 1.3, 4.0), random));
  walkers.push_back(MakePedestrian(
      "visitor", ThereAndBack({17.3, -8.0, 0.0}, {17.8, 8.0, 0.0}, 0.7, 0.9, 10.0), random));
  return walkers;
}

}  // namespace

Place MakeQuad(std::uint64_t seed) {
  RandomStream random(seed, "quad");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const ValueNoise bumps(random.NextBits());
  const HeightField ground = [&](double x, double y) {
    return 0.05 * bumps.At({0.3 * x, 0.3 * y, 0.0}) + 0.02 * bumps.At({1.1 * x, 1.1 * y, 5.0});
  };
  AddWalls(builder, m, random);
  AddGateTower(builder, m, random);
  AddTerrain(builder, {-kEast - 1.0, -kNorth - 7.0}, {kEast + 1.0, kNorth + 1.0}, 0.8, ground,
             m.gravel);
  AddOval(
      builder, {0.0, 0.0}, {11.0, 7.5}, [&](double x, double y) { return 0.14 + ground(x, y); },
      0.25, m.grass, m.stone);
  AddGarden(builder, m, ground, random);
  // Once round, across the lawn, and back along two sides the other way round.
  WalkingPath path = WalkAt(kHandheldHeight,
                            {{0.0, -11.0, 0.0},
                             {14.5, -11.0, 0.0},
                             {14.5, 10.5, 0.0},
                             {-14.5, 10.5, 0.0},
                             {-14.5, -10.5, 0.0},
                             {-6.0, -10.8, 0.0},
                             {-3.0, -3.5, 0.0},
                             {-2.5, 4.0, 0.0},
                             {3.5, 11.5, 0.0},
                             {13.3, 11.6, 0.0},
                             {13.4, -9.9, 0.0},
                             {2.0, -9.6, 0.0},
                             {-2.5, -9.8, 0.0},
                             {-3.4, -11.2, 0.0}},
                            0.8);
  return {.world = World(std::move(builder).Finish(), Daylight(), Walkers(random)),
          .path = std::move(path)};
}

}  // namespace mlvi

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

// A foyer of 14 x 8 m with a corridor in the west; its glass front is in the south at y = 0, the
// door in it at x = kDoor.
constexpr double kEast = 14.0, kNorth = 8.0, kHeight = 3.6, kDoor = 6.0;  // m
constexpr double kCorridorHeight = 2.9;

// Under the ceilings of corridor and foyer.
std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps;
  for (const double x : {-14.0, -10.0, -6.0, -2.0}) lamps.emplace_back(x, 5.8, kCorridorHeight);
  for (const double x : {3.5, 7.0, 10.5}) lamps.emplace_back(x, 5.0, kHeight);
  return lamps;
}

// By day, with some 50 lux on the floor below each lamp.
Lighting LitDaylight() {
  Lighting lighting = Daylight();
  lighting.ambient_illuminance = 5.0;
  for (const Eigen::Vector3d& lamp : Lamps()) {
    lighting.lamps.push_back(
        {.position = lamp - Eigen::Vector3d(0.0, 0.0, 0.15), .intensity = 480.0});
  }
  return lighting;
}

void AddFoyer(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const WallHoles holes{.south = {FramedPassage(kDoor - 1.1, kDoor + 1.1, 2.5, m.metal)},
                        .east = {Door(2.0, m.door, m.frame), Door(5.5, m.door, m.frame)},
                        .north = {Door(3.0 + random.Uniform(-0.5, 0.5), m.door, m.frame),
                                  Door(10.0, m.door, m.frame)},
                        .west = {Passage(4.6, 7.0, 2.6)}};
  AddRoom(builder, {0.0, 0.0, 0.0}, {kEast, kNorth, kHeight},
          {m.glass, m.paint, m.paint, m.plaster, m.tiles, m.ceiling}, holes);
  for (double x = 1.0; x < kEast; x += 1.6) {
    if (std::abs(x - kDoor) < 1.3) continue;
    AddBeam(builder, {x, 0.06, 0.0}, {x, 0.06, kHeight}, 0.07, 0.12, m.metal);
  }
  AddRoom(builder, {-16.0, 4.5, 0.0}, {-0.2, 7.1, kCorridorHeight},
          Painted(m.paint, m.linoleum, m.ceiling),
          {.south = {Door(-12.0, m.door, m.frame),
                     Door(-6.0 + random.Uniform(-0.5, 0.5), m.door, m.frame)},
           .east = {FramedPassage(4.6, 7.0, 2.6, m.frame)},
           .north = {Door(-9.0, m.door, m.frame), Door(-3.0, m.door, m.frame)}});
  for (const Eigen::Vector3d& lamp : Lamps()) {
    builder.AddBox({lamp.x(), lamp.y(), lamp.z() - 0.06}, {1.2, 0.3, 0.06}, 0.0, m.lamp);
  }
  AddSofa(builder, {{10.5, 7.3, 0.0}}, 2.2, m);
  AddTable(builder, {{12.6, 4.0, 0.0}, 1.5}, {1.4, 0.7, 0.75}, m);
  AddPicture(builder, {{6.5, kNorth - 0.05, 0.8}}, 2.6, 1.5, m.posters);
  AddPicture(builder, {{-11.0, 7.05, 1.0}}, 1.5, 1.0, m.posters);
  AddClutter(builder, {{-15.2, 5.8, 0.0}}, 0.4, 5, m, random);
  builder.AddColumn({10.0, 3.0, 0.0}, 0.3, kHeight, 16, m.paint);
}

// The building's other walls, steps aside a ramp, a forecourt with trees, cars and a hedge.
void AddForecourt(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const ValueNoise bumps(random.NextBits());
  AddTerrain(
      builder, {-30.0, -32.0}, {40.0, -0.2}, 1.0,
      [&](double x, double y) {
        return -0.08 + 0.03 * bumps.At({0.3 * x, 0.3 * y, 0.0});
      },
      m.asphalt);
  builder.AddBox({kDoor, -1.4, -0.15}, {6.0, 2.4, 0.15}, 0.0, m.concrete);
  const FacadeStyle front{.wall = m.brick,
                          .window = m.window,
                          .door = m.door,
                          .trim = m.concrete,
                          .height = 12.0,
                          .bay = 3.0};
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  AddFacade(builder, {-30.0, -0.2, 0.0}, x, 30.0, front, {}, random);
  AddFacade(builder, {kEast, -0.2, 0.0}, x, 26.0, front, {}, random);
  builder.AddBox({0.5 * kEast, -1.0, kHeight}, {kEast + 2.0, 2.4, 0.4}, 0.0, m.concrete);
  FacadeStyle upper = front;
  upper.height = 8.0;
  upper.doors = 0;
  AddFacade(builder, {0.0, -0.2, kHeight + 0.4}, x, kEast, upper, {}, random);
  FacadeStyle opposite = front;
  opposite.wall = m.plaster;
  opposite.height = 9.0;
  AddFacade(builder, {40.0, -32.0, 0.0}, -x, 70.0, opposite, {}, random);
  AddFacade(builder, {-30.0, -32.0, 0.0}, y, 14.0, opposite, {}, random);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(-4.0, -9.0), Eigen::Vector2d(14.0, -10.5),
                                    Eigen::Vector2d(23.0, -13.0), Eigen::Vector2d(-15.0, -7.5)}) {
    AddBranchedTree(builder, {at.x(), at.y(), -0.1},
                    {.height = random.Uniform(5.0, 8.0), .crown = random.Uniform(1.5, 2.2)},
                    {m.bark, m.leaf}, random);
  }
  for (double u = -2.0; u < 13.0; u += 2.7) {
    if (random.Uniform() < 0.3) continue;
    const MaterialId paint = random.Uniform() < 0.5 ? m.silver_car : m.dark_car;
    AddCar(builder, {{u, -25.0, -0.1}, 1.57 + random.Uniform(-0.05, 0.05)}, paint, m);
  }
  AddFoliage(builder, {{-9.0, -3.0, 0.0}}, {14.0, 0.8, 1.1}, 1500, 0.07, m.leaf, random);
  for (double u = 15.0; u < 21.0; u += random.Uniform(0.6, 0.9))
    AddBicycle(builder, {{u, -1.6, -0.1}, 1.57 + random.Uniform(-0.2, 0.2)}, m);
}

std::vector<MovingObject> PassersBy(RandomStream& random) {
  std::vector<MovingObject> people;
  people.push_back(MakePedestrian(
      "passer-by", ThereAndBack({-24.0, -20.5, -0.08}, {30.0, -20.0, -0.08}, 0.9, 1.3, 20.0),
      random));
  people.push_back(MakePedestrian(
      "student", ThereAndBack({12.0, 1.6, 0.0}, {12.2, 6.0, 0.0}, 0.5, 0.9, 1.0), random));
  return people;
}

}  // namespace

Place MakeDoor(std::uint64_t seed) {
  RandomStream random(seed, "door");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddFoyer(builder, m, random);
  AddForecourt(builder, m, random);
  // From the corridor through the foyer and the door, round the forecourt, and in again.
  return {.world = World(std::move(builder).Finish(), LitDaylight(), PassersBy(random)),
          .path = WalkAt(kRobotHeight,
                         {{-13.0, 5.4, 0.0},
                          {-1.0, 5.4, 0.0},
                          {2.5, 5.0, 0.0},
                          {kDoor - 0.4, 2.8, 0.0},
                          {kDoor - 0.3, -3.0, 0.0},
                          {8.5, -7.0, 0.0},
                          {18.0, -7.5, 0.0},
                          {18.5, -15.0, 0.0},
                          {6.0, -16.5, 0.0},
                          {1.5, -10.0, 0.0},
                          {kDoor + 0.2, -4.0, 0.0},
                          {kDoor + 0.3, 2.8, 0.0},
                          {3.5, 5.8, 0.0},
                          {-1.0, 6.2, 0.0},
                          {-13.0, 6.2, 0.0},
                          {-14.2, 5.8, 0.0}},
                         0.45)};
}

}  // namespace mlvi

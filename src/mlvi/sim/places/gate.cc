// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/value_noise.h"
#include "mlvi/sim/places/vegetation.h"
#include "mlvi/sim/places/vehicles.h"

namespace mlvi {
namespace {

// The campus lies north of the gate at y = 0, a street runs south of it.
void AddGateItself(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (const double x : {-11.0, -5.0, 5.0, 11.0}) {
    builder.AddBox({x, 0.0, -0.2}, {1.5, 1.5, 6.2}, 0.0, m.stone);
    builder.AddBox({x, 0.0, -0.2}, {1.8, 1.8, 0.8}, 0.0, m.old_stone);
    builder.AddBox({x, 0.0, 5.6}, {1.9, 1.9, 0.4}, 0.0, m.old_stone);
  }
  builder.AddBox({0.0, 0.0, 6.2}, {25.0, 1.7, 1.3}, 0.0, m.stone);
  builder.AddBox({0.0, 0.0, 7.5}, {13.0, 1.4, 0.9}, 0.0, m.roof_tiles);
  AddPicture(builder, {{0.0, -0.9, 6.4}}, 7.0, 0.9, m.posters);
  AddPipe(builder, {-4.2, 1.5, 0.95}, {-0.8, 1.5, 1.15 + random.Uniform(0.0, 0.2)}, 0.06, 0.04, 8,
          m.markings);  // the barrier
  builder.AddBox({-4.4, 1.5, 0.0}, {0.4, 0.4, 1.1}, 0.0, m.red_car);
  // The porter's lodge.
  const FacadeStyle lodge{.wall = m.brick,
                          .window = m.window,
                          .door = m.door,
                          .trim = m.concrete,
                          .height = 3.2,
                          .bay = 2.2};
  AddFacades(builder, {-9.8, 3.0, 0.0}, {4.6, 5.0}, false, {lodge}, {}, random);
  builder.AddBox({-7.5, 5.5, 3.2}, {5.4, 5.8, 0.3}, 0.0, m.concrete);
}

// Railings on a low wall either side of the gate.
void AddFences(MeshBuilder& builder, const Palette& m) {
  for (const double side : {-1.0, 1.0}) {
    builder.AddBox({side * 26.0, 0.0, -0.3}, {28.4, 0.4, 1.0}, 0.0, m.brick);
    for (double x = 12.4; x < 40.0; x += 0.16) {
      AddBeam(builder, {side * x, 0.0, 0.7}, {side * x, 0.0, 2.3}, 0.025, 0.025, m.metal);
    }
    AddBeam(builder, {side * 12.0, 0.0, 2.2}, {side * 40.0, 0.0, 2.2}, 0.04, 0.06, m.metal);
    for (double x = 16.0; x < 40.0; x += 4.7)
      builder.AddBox({side * x, 0.0, -0.3}, {0.6, 0.6, 2.9}, 0.0, m.brick);
  }
}

void AddCampus(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const FacadeStyle house{.wall = m.brick,
                          .window = m.window,
                          .door = m.door,
                          .trim = m.concrete,
                          .height = 14.0,
                          .doors = 2};
  FacadeStyle office = house;
  office.wall = m.plaster;
  office.height = 18.0;
  AddFacades(builder, {-34.0, 22.0, 0.0}, {22.0, 14.0}, false, {house, house}, {}, random);
  AddFacades(builder, {14.0, 18.0, 0.0}, {20.0, 16.0}, false, {office, office}, {}, random);
  office.wall = m.concrete;
  AddFacade(builder, {42.0, -24.0, 0.0}, -Eigen::Vector3d::UnitX(), 84.0, office, {}, random);
  for (double y = 4.0; y < 40.0; y += random.Uniform(5.0, 7.5)) {  // an avenue
    for (const double side : {-1.0, 1.0}) {
      if (side < 0.0 && y < 10.0) continue;
      AddBranchedTree(builder, {side * 9.5 + random.Uniform(-0.4, 0.4), y, 0.0},
                      {.height = random.Uniform(6.5, 9.0), .crown = random.Uniform(1.8, 2.4)},
                      {m.bark, m.leaf}, random);
    }
  }
  for (const double side : {-1.0, 1.0}) {
    AddFoliage(builder, {{side * 8.0, 24.0, 0.0}}, {0.9, 28.0, 0.9}, 2500, 0.07, m.leaf, random);
    for (double y = 6.0; y < 38.0; y += 11.0) {
      AddPipe(builder, {side * 6.6, y, -0.1}, {side * 6.6, y, 5.5}, 0.08, 0.05, 8, m.metal);
      builder.AddBox({side * 6.2, y, 5.4}, {0.9, 0.25, 0.15}, 0.0, m.lamp);
    }
  }
  AddCar(builder, {{-18.0, 11.0, 0.0}, 0.1}, m.silver_car, m);
  AddCar(builder, {{-18.5, 14.2, 0.0}, 0.05}, m.dark_car, m);
  AddVan(builder, {{18.0, -6.0, 0.0}, 3.14}, m.white_metal, m);
  AddCar(builder, {{-20.0, -6.0, 0.0}, 3.14}, m.red_car, m);
}

std::vector<MovingObject> Traffic(RandomStream& random) {
  std::vector<MovingObject> movers;
  movers.push_back(MakePedestrian(
      "student", ThereAndBack({5.6, 4.0, 0.0}, {5.8, 34.0, 0.0}, -0.7, 1.3, 8.0), random));
  movers.push_back(MakePedestrian(
      "porter", ThereAndBack({-5.5, 12.0, 0.0}, {-5.3, 20.0, 0.0}, 0.6, 0.9, 2.0), random));
  movers.push_back(MakePedestrian(
      "passer-by", ThereAndBack({-36.0, -2.7, 0.08}, {-13.5, -2.8, 0.08}, 0.6, 1.3, 0.0), random));
  movers.push_back(MakeVehicle(
      "car", ThereAndBack({-80.0, -18.0, 0.0}, {80.0, -18.0, 0.0}, 3.4, 9.0, 30.0), false, random));
  movers.push_back(MakeVehicle(
      "van", ThereAndBack({-90.0, -18.0, 0.0}, {90.0, -18.0, 0.0}, 3.4, 7.5, 220.0), true, random));
  return movers;
}

}  // namespace

Place MakeGate(std::uint64_t seed) {
  RandomStream random(seed, "gate");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const ValueNoise bumps(random.NextBits());
  AddGateItself(builder, m, random);
  AddFences(builder, m);
  AddCampus(builder, m, random);
  AddTerrain(
      builder, {-42.0, -24.0}, {42.0, 45.0}, 1.2,
      [&](double x, double y) {
        return 0.03 * bumps.At({0.2 * x, 0.2 * y, 0.0}) - 0.03;
      },
      m.asphalt);
  builder.AddBox({0.0, -3.8, -0.1}, {80.0, 3.0, 0.17}, 0.0, m.flagstone);  // pavement
  // Out through the gate, along the pavement, back in through the other opening.
  return {.world = World(std::move(builder).Finish(), Daylight(), Traffic(random)),
          .path = WalkAt(kRobotHeight,
                         {{3.0, 24.0, 0.0},
                          {3.2, 8.0, 0.0},
                          {2.6, -3.0, 0.1},
                          {11.0, -4.0, 0.1},
                          {13.0, -8.0, 0.0},
                          {0.0, -10.0, 0.0},
                          {-11.0, -8.0, 0.0},
                          {-10.5, -4.0, 0.1},
                          {-2.4, -3.6, 0.1},
                          {2.2, 4.0, 0.0},
                          {-2.0, 16.0, 0.0},
                          {-3.0, 25.0, 0.0},
                          {0.0, 28.0, 0.0}},
                         0.8)};
}

}  // namespace mlvi

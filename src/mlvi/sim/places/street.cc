// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <numbers>

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

// The street runs along x; lanes between y = -3.2 and 3.2, parked cars to 5.4, pavements to 9,
// houses behind front gardens at 12.
constexpr double kEnd = 60.0, kKerb = 5.4, kPavement = 9.0, kHouses = 12.0;  // m

// Where the walk crosses the street; nothing stands there.
bool NearCrossing(double x, double margin) {
  return std::abs(x - 33.9) < margin || std::abs(x + 39.9) < margin;
}

void AddHouses(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const std::array<MaterialId, 4> walls = {m.brick, m.plaster, m.stone, m.concrete};
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d along = -side * Eigen::Vector3d::UnitX();
    for (double x = -kEnd; x < kEnd - 4.0;) {
      const double width = random.Uniform(9.0, 18.0);
      const FacadeStyle style{.wall = walls[static_cast<std::size_t>(random.Uniform(0.0, 4.0))],
                              .window = m.window,
                              .door = m.door,
                              .trim = m.concrete,
                              .height = random.Uniform(8.0, 15.0),
                              .bay = random.Uniform(2.6, 4.0),
                              .window_width = random.Uniform(1.0, 1.6)};
      const double setback = kHouses + random.Uniform(0.0, 1.5);
      const Eigen::Vector3d corner(side > 0.0 ? x + width : x, side * setback, 0.0);
      AddFacade(builder, corner, along, width, style, {}, random);
      for (const double end : {x, x + width}) {  // party walls
        builder.AddPanel({.corner = {end, side * setback, -0.3},
                          .u = side * Eigen::Vector3d::UnitY(),
                          .width = 8.0,
                          .height = style.height + 0.3},
                         m.brick);
      }
      x += width + (random.Uniform() < 0.3 ? random.Uniform(2.0, 5.0) : 0.0);
    }
  }
}

void AddTraffic(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const std::array<MaterialId, 4> paints = {m.red_car, m.silver_car, m.dark_car, m.white_metal};
  for (const double side : {-1.0, 1.0}) {
    for (double x = -kEnd + 4.0; x < kEnd - 4.0; x += random.Uniform(5.2, 9.5)) {
      const double kind = NearCrossing(x, 5.0) ? 1.0 : random.Uniform();
      const MaterialId paint = paints[static_cast<std::size_t>(random.Uniform(0.0, 4.0))];
      const Placement place{{x, side * (4.4 + random.Uniform(-0.12, 0.12)), 0.0},
                            (side > 0.0 ? std::numbers::pi : 0.0) + random.Uniform(-0.03, 0.03)};
      if (kind < 0.6) AddCar(builder, place, paint, m);
      if (kind > 0.6 && kind < 0.72) AddVan(builder, place, paint, m);
    }
  }
  for (double x = -kEnd + 2.0; x < kEnd; x += 6.0)
    builder.AddBox({x, 0.0, 0.0}, {3.0, 0.12, 0.015}, 0.0, m.markings);
}

// Street trees, lamps, signs, hedges and low walls of the front gardens, bins, bicycles.
void AddPavements(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (const double side : {-1.0, 1.0}) {
    builder.AddBox({0.0, side * 0.5 * (kKerb + kPavement), -0.2},
                   {2.0 * kEnd, kPavement - kKerb, 0.32}, 0.0, m.flagstone);
    for (double x = -kEnd + 3.0; x < kEnd; x += random.Uniform(7.0, 12.0)) {
      if (NearCrossing(x, 3.0) || NearCrossing(x + 3.1, 3.0)) continue;
      AddBranchedTree(builder, {x, side * 6.0, 0.1},
                      {.height = random.Uniform(6.0, 9.5),
                       .crown = random.Uniform(1.8, 2.6),
                       .clear_trunk = 2.6},
                      {m.bark, m.leaf}, random);
      AddPipe(builder, {x + 3.1, side * 5.8, 0.0}, {x + 3.1, side * 5.8, 6.5}, 0.07, 0.05, 8,
              m.metal);
      AddBeam(builder, {x + 3.1, side * 5.8, 6.5}, {x + 3.1, side * 4.4, 6.7}, 0.06, 0.06, m.metal);
      if (random.Uniform() < 0.4) {
        const Placement sign{{x + 1.5, side * 5.75, 0.1}, 1.57};
        AddPipe(builder, sign.origin, sign.At(0.0, 0.0, 2.6), 0.03, 0.03, 8, m.metal);
        AddPicture(builder, sign.Within(0.0, 0.05, 2.0), 0.6, 0.6, m.sign);
      }
    }
    for (double x = -kEnd; x < kEnd - 3.0; x += random.Uniform(6.0, 10.0)) {
      const double width = random.Uniform(2.5, 5.5);
      const Placement at{{x + 0.5 * width, side * (kPavement + 0.4), 0.0}, 0.0};
      if (random.Uniform() < 0.55) {
        AddFoliage(builder, at, {width, 0.7, random.Uniform(0.8, 1.7)},
                   static_cast<int>(130.0 * width), 0.07, m.leaf, random);
      } else {
        AddBoxAt(builder, at, {0.0, 0.0, -0.1}, {width, 0.25, random.Uniform(0.6, 1.1)}, m.brick);
      }
      if (random.Uniform() < 0.5)
        AddBicycle(builder, {{x + width + 0.6, side * (kPavement + 0.3), 0.1}, 0.2}, m);
    }
  }
}

// Six people on the pavements beside the robot's way, three vehicles that turn beyond the ends of
// the street. None is on a crossing while the robot is (recording_test).
std::vector<MovingObject> Traffic(RandomStream& random) {
  std::vector<MovingObject> movers;
  for (const double side : {-1.0, 1.0}) {
    for (const double start : {8.0, 40.0, 85.0}) {
      const Eigen::Vector3d from(-34.0 + 0.2 * start, 8.55 * side, 0.12);
      const Eigen::Vector3d to(27.0, 8.5 * side, 0.12);
      movers.push_back(MakePedestrian(
          "pedestrian", ThereAndBack(from, to, 0.25 * side, random.Uniform(0.9, 1.4), start),
          random));
    }
  }
  const Eigen::Vector3d west(-150.0, -1.6, 0.0), east(150.0, -1.6, 0.0);
  movers.push_back(MakeVehicle("car", ThereAndBack(west, east, 3.2, 8.5, 60.0), false, random));
  movers.push_back(MakeVehicle("van", ThereAndBack(west, east, 3.2, 8.0, 310.0), true, random));
  return movers;
}

}  // namespace

Place MakeStreet(std::uint64_t seed) {
  RandomStream random(seed, "street");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  const ValueNoise bumps(random.NextBits());
  AddHouses(builder, m, random);
  AddTraffic(builder, m, random);
  AddPavements(builder, m, random);
  AddTerrain(
      builder, {-kEnd - 2.0, -kHouses - 4.0}, {kEnd + 2.0, kHouses + 4.0}, 1.0,
      [&](double x, double y) {
        const double camber = -0.02 * std::min(std::abs(y), kKerb) / kKerb;
        return camber - 0.01 + 0.015 * bumps.At({0.5 * x, 0.5 * y, 0.0});
      },
      m.asphalt);
  // Up one pavement, across, down the other one.
  const double y = 7.6, z = 0.12;
  return {.world = World(std::move(builder).Finish(), Daylight(), Traffic(random)),
          .path = WalkAt(kRobotHeight,
                         {{-36.0, -y, z},
                          {30.0, -y, z},
                          {33.0, -6.5, z},
                          {34.5, 0.0, 0.0},
                          {33.0, 6.5, z},
                          {30.0, y, z},
                          {-36.0, y, z},
                          {-39.0, 6.5, z},
                          {-40.5, 0.0, 0.0},
                          {-39.0, -6.5, z}},
                         0.7)};
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/terrain.h"
#include "mlvi/sim/places/vegetation.h"

namespace mlvi {
namespace {

constexpr double kEast = 44.0, kNorth = 22.0, kHeight = 7.0;  // m

// Walls of glass in the south and west between posts and transoms; solid walls in the north and
// east.
void AddShell(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const auto door = [&](double u) { return Door(u + random.Uniform(-1.0, 1.0), m.door, m.frame); };
  AddRoom(
      builder, {0.0, 0.0, 0.0}, {kEast, kNorth, kHeight},
      {m.glass, m.plaster, m.paint, m.glass, m.tiles, m.ceiling},
      {.east = {door(5.0), door(15.0)}, .north = {door(6.0), door(17.0), door(30.0), door(38.0)}});
  const Eigen::Vector3d up(0.0, 0.0, kHeight);
  for (double x = 2.0; x < kEast; x += 2.0)
    AddBeam(builder, Eigen::Vector3d(x, 0.08, 0.0), Eigen::Vector3d(x, 0.08, 0.0) + up, 0.08, 0.16,
            m.metal);
  for (double y = 2.0; y < kNorth; y += 2.0)
    AddBeam(builder, Eigen::Vector3d(0.08, y, 0.0), Eigen::Vector3d(0.08, y, 0.0) + up, 0.16, 0.08,
            m.metal);
  for (const double z : {0.1, 3.0, 5.5}) {
    AddBeam(builder, {0.0, 0.08, z}, {kEast, 0.08, z}, 0.14, 0.1, m.metal);
    AddBeam(builder, {0.08, 0.0, z}, {0.08, kNorth, z}, 0.14, 0.1, m.metal);
  }
  for (double x = 5.5; x < kEast; x += 8.2) {
    for (const double y : {6.0, 16.0})
      builder.AddColumn({x + random.Uniform(-0.3, 0.3), y, 0.0}, 0.4, kHeight, 20, m.plaster);
  }
}

// A gallery along the north wall, with a flight of stairs up to it.
void AddGallery(MeshBuilder& builder, const Palette& m) {
  constexpr double kLevel = 3.6;
  builder.AddBox({22.0, kNorth - 1.5, kLevel - 0.3}, {30.0, 3.0, 0.3}, 0.0, m.concrete);
  AddRailing(builder, {7.0, kNorth - 3.0, kLevel}, {37.0, kNorth - 3.0, kLevel}, 1.5, m.metal);
  builder.AddStairs({43.2, kNorth - 0.6, 0.0}, -Eigen::Vector3d::UnitX(), -1.8, 20, 0.31, 0.18,
                    m.concrete);
  AddRailing(builder, {43.0, kNorth - 2.45, 0.1}, {37.0, kNorth - 2.45, kLevel}, 1.2, m.metal);
}

void AddInterior(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  builder.AddBox({22.0, 11.0, 0.0}, {4.2, 1.1, 1.1}, 0.15, m.wood);  // reception
  AddChair(builder, {{22.3, 12.1, 0.0}, 0.3}, m);
  for (const Eigen::Vector3d& s :
       {Eigen::Vector3d(8.0, 10.5, 0.0), Eigen::Vector3d(10.5, 12.6, 2.9),
        Eigen::Vector3d(34.0, 10.6, 0.4)})
    AddSofa(builder, {{s.x(), s.y(), 0.0}, s.z()}, 1.9, m);
  AddTable(builder, {{9.2, 11.6, 0.0}, 0.2}, {1.0, 0.6, 0.45}, m);
  for (double x = 3.0; x < kEast; x += random.Uniform(5.0, 9.0)) {  // plants at the glass
    builder.AddColumn({x, 1.0, 0.0}, 0.3, 0.5, 12, m.concrete);
    AddFoliage(builder, {{x, 1.0, 0.5}}, {0.9, 0.9, 1.3}, 160, 0.08, m.leaf, random);
  }
  for (double x = 12.0; x < 36.0; x += 6.0) {  // a row of exhibition boards
    const Placement board{{x, 16.9, 0.0}, random.Uniform(-0.25, 0.25)};
    AddPicture(builder, board.Within(0.0, 0.0, 0.5), 1.8, 1.3, m.posters);
    for (const double side : {-0.8, 0.8})
      AddBoxAt(builder, board, {side, 0.0, 0.0}, {0.05, 0.4, 1.9}, m.metal);
  }
  AddClutter(builder, {{42.0, 3.0, 0.0}}, 0.8, 8, m, random);
}

void AddOutside(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  builder.AddPanel({.corner = {-25.0, -25.0, -0.1},
                    .v = Eigen::Vector3d::UnitY(),
                    .width = 80.0,
                    .height = 24.9},
                   m.flagstone);
  builder.AddPanel(
      {.corner = {-25.0, -0.1, -0.1}, .v = Eigen::Vector3d::UnitY(), .width = 24.9, .height = 40.0},
      m.grass);
  const FacadeStyle opposite{
      .wall = m.brick, .window = m.window, .door = m.door, .trim = m.concrete, .height = 12.0};
  AddFacade(builder, {55.0, -22.0, 0.0}, -Eigen::Vector3d::UnitX(), 80.0, opposite, {}, random);
  for (double x = -3.0; x < 45.0; x += random.Uniform(7.0, 11.0)) {
    AddBranchedTree(builder, {x, -9.0 + random.Uniform(-2.0, 2.0), 0.0},
                    {.height = random.Uniform(5.0, 8.0), .crown = 2.0}, {m.bark, m.leaf}, random);
  }
}

std::vector<MovingObject> Visitors(RandomStream& random) {
  std::vector<MovingObject> visitors;
  visitors.push_back(MakePedestrian(
      "visitor", ThereAndBack({9.0, 8.3, 0.0}, {34.0, 8.0, 0.0}, 0.7, 1.2, 5.0), random));
  visitors.push_back(MakePedestrian(
      "guest", ThereAndBack({38.0, 17.6, 0.0}, {14.0, 18.0, 0.0}, 0.6, 1.0, 12.0), random));
  visitors.push_back(MakePedestrian(
      "passer-by", ThereAndBack({2.0, -4.0, -0.1}, {40.0, -4.5, -0.1}, 0.8, 1.4, 0.0), random));
  return visitors;
}

}  // namespace

Place MakeHall(std::uint64_t seed) {
  RandomStream random(seed, "hall");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddShell(builder, m, random);
  AddGallery(builder, m);
  AddInterior(builder, m, random);
  AddOutside(builder, m, random);
  return {.world = World(std::move(builder).Finish(), Daylight(), Visitors(random)),
          .path = WalkAt(kRobotHeight,
                         {{5.0, 3.4, 0.0},
                          {30.0, 3.2, 0.0},
                          {40.3, 4.2, 0.0},
                          {40.6, 13.0, 0.0},
                          {28.0, 14.2, 0.0},
                          {13.5, 14.2, 0.0},
                          {4.0, 13.5, 0.0},
                          {3.2, 6.0, 0.0}},
                         0.9)};
}

}  // namespace mlvi

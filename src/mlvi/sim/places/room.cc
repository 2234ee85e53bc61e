// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/rooms.h"

namespace mlvi {
namespace {

constexpr double kEast = 11.0, kNorth = 8.6, kHeight = 3.1;  // m

void AddShell(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const auto jitter = [&] { return random.Uniform(-0.2, 0.2); };
  const WallHoles holes{.south = {Window(2.2 + jitter(), 1.7, 1.6, m.window, 0.25),
                                  Window(5.4 + jitter(), 1.7, 1.6, m.window, 0.25),
                                  Window(8.6 + jitter(), 1.7, 1.6, m.window, 0.25)},
                        .north = {Door(9.2 + jitter(), m.door, m.frame)},
                        .west = {Door(6.8 + jitter(), m.door, m.frame)}};
  AddRoom(builder, {0.0, 0.0, 0.0}, {kEast, kNorth, kHeight},
          Painted(m.paint, m.linoleum, m.ceiling), holes);
  for (const double x : {2.2, 5.4, 8.6}) AddRadiator(builder, {{x, 0.12, 0.0}}, 1.4, m);
  for (double x = 1.4; x < kEast; x += 2.4) {
    for (double y = 1.4; y < kNorth; y += 2.9)
      builder.AddBox({x, y, kHeight - 0.06}, {1.2, 0.3, 0.06}, 0.0, m.lamp);
  }
  builder.AddBox({kEast - 0.2, kNorth - 0.2, 0.0}, {0.4, 0.4, kHeight}, 0.0, m.paint);
  builder.AddBox({0.5 * kEast, kNorth - 0.15, kHeight - 0.35}, {kEast, 0.3, 0.25}, 0.0, m.metal);
}

// Desks and shelves along the walls, a rail of motion-capture cameras above, the middle free.
void AddInterior(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const double half_turn = std::numbers::pi;
  for (const double x : {1.2, 3.1, 7.4})
    AddDesk(builder, {{x, 0.65, 0.0}, half_turn + random.Uniform(-0.05, 0.05)}, m, random);
  for (const double x : {2.5, 4.4}) AddDesk(builder, {{x, kNorth - 0.5, 0.0}}, m, random);
  AddShelf(builder, {{kEast - 0.25, 2.0, 0.0}, -0.5 * half_turn}, 1.6, 2.1, m, random);
  AddShelf(builder, {{kEast - 0.25, 4.0, 0.0}, -0.5 * half_turn}, 1.8, 1.7, m, random);
  AddShelf(builder, {{0.25, 3.4, 0.0}, 0.5 * half_turn}, 1.8, 2.1, m, random);
  AddSofa(builder, {{kEast - 0.6, 6.4, 0.0}, -0.5 * half_turn}, 1.5, m);
  AddClutter(builder, {{0.6, 0.7, 0.0}}, 0.35, 5, m, random);
  AddClutter(builder, {{10.2, 0.7, 0.0}}, 0.4, 6, m, random);
  AddPicture(builder, {{6.9, kNorth - 0.05, 0.9}}, 2.4, 1.2, m.posters);
  AddPicture(builder, {{0.05, 5.3, 1.1}, 0.5 * half_turn}, 1.2, 0.9, m.posters);
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.4, 0.4), Eigen::Vector2d(10.4, 0.5),
                                    Eigen::Vector2d(0.5, 8.1), Eigen::Vector2d(10.3, 7.8)}) {
    AddPipe(builder, {at.x(), at.y(), 0.0}, {at.x(), at.y(), 2.5}, 0.03, 0.03, 8, m.metal);
    builder.AddBox({at.x(), at.y(), 2.5}, {0.15, 0.15, 0.18}, 0.8, m.plastic);
  }
}

std::vector<Eigen::Vector3d> WalkOf(int variant) {
  if (variant == 1) return {{3.4, 2.7, 0.0}, {7.6, 2.7, 0.0}, {7.8, 5.6, 0.0}, {3.2, 5.7, 0.0}};
  if (variant == 2) {  // a figure of eight
    return {{3.2, 2.8, 0.0}, {5.2, 3.6, 0.0}, {7.6, 5.7, 0.0}, {8.6, 4.2, 0.0},
            {7.4, 2.7, 0.0}, {5.4, 4.4, 0.0}, {3.4, 5.8, 0.0}, {2.5, 4.2, 0.0}};
  }
  return {{3.0, 5.8, 0.0}, {8.0, 5.8, 0.0}, {8.4, 3.0, 0.0},
          {6.0, 2.6, 0.0}, {4.8, 4.2, 0.0}, {2.8, 3.0, 0.0}};
}

std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps;
  for (const double x : {2.6, 5.5, 8.4}) {
    for (const double y : {2.2, 6.4}) lamps.emplace_back(x, y, kHeight - 0.2);
  }
  return lamps;
}

// One who walks along the shelves in the east, one in the west, one who paces in the middle.
std::vector<MovingObject> People(int variant, RandomStream& random) {
  std::vector<MovingObject> people;
  people.push_back(MakePedestrian("person at the shelves",
                                  ThereAndBack({9.8, 2.6, 0.0}, {9.8, 5.0, 0.0}, 0.4, 0.9, 1.0),
                                  random));
  if (variant >= 2) {
    people.push_back(MakePedestrian("person at the desks",
                                    ThereAndBack({1.5, 2.7, 0.0}, {1.5, 6.2, 0.0}, 0.5, 1.1, 2.0),
                                    random));
  }
  if (variant == 3) {
    people.push_back(MakePedestrian(
        "pacing person", ThereAndBack({6.2, 4.3, 0.0}, {7.0, 4.4, 0.0}, 0.3, 0.7, 0.0), random));
  }
  return people;
}

}  // namespace

Place MakeRoom(std::uint64_t seed, int variant) {
  RandomStream random(seed, "room");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddShell(builder, m, random);
  AddInterior(builder, m, random);
  return {
      .world = World(std::move(builder).Finish(), Indoors(350.0, Lamps()), People(variant, random)),
      .path = WalkAt(kRobotHeight, WalkOf(variant), 0.5)};
}

}  // namespace mlvi

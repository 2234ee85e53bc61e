// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/vehicles.h"

namespace mlvi {
namespace {

constexpr double kHeight = 2.55;  // m

// A round of passages through a plant room and a store: passage along y = 0, plant room in the
// east, passage along y = 12 back to the store in the west.
void AddRooms(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const RoomMaterials raw = Painted(m.concrete, m.concrete, m.concrete);
  const auto door = [&](double u) { return Door(u + random.Uniform(-0.4, 0.4), m.door, m.frame); };
  AddRoom(builder, {0.0, -0.95, 0.0}, {22.0, 0.95, kHeight},
          Painted(m.plaster, m.concrete, m.concrete),
          {.south = {door(4.0), door(9.0), door(17.0)},
           .east = {FramedPassage(-0.7, 0.7, 2.1, m.frame)},
           .north = {door(6.5), door(14.0)},
           .west = {Passage(-0.7, 0.7, 2.1)}});
  AddRoom(builder, {22.2, -3.0, 0.0}, {31.0, 14.5, 3.4}, raw,
          {.east = {door(2.0)}, .west = {Passage(-0.7, 0.7, 2.1), Passage(11.3, 12.7, 2.1)}});
  AddRoom(builder, {2.0, 11.05, 0.0}, {22.0, 12.95, kHeight}, raw,
          {.south = {door(7.0), door(15.0)},
           .east = {FramedPassage(11.3, 12.7, 2.1, m.frame)},
           .north = {door(11.0), door(18.5)},
           .west = {Passage(11.4, 12.6, 2.1)}});
  AddRoom(
      builder, {-6.0, -3.0, 0.0}, {-0.2, 14.5, kHeight}, Painted(m.brick, m.concrete, m.concrete),
      {.east = {FramedPassage(-0.7, 0.7, 2.1, m.frame), FramedPassage(11.3, 12.7, 2.1, m.frame)}});
  AddRoom(builder, {0.0, 11.3, 0.0}, {1.8, 12.7, kHeight}, raw,
          {.east = {FramedPassage(11.4, 12.6, 2.1, m.frame)}, .west = {Passage(11.3, 12.7, 2.1)}});
}

// Pipes and cable trays under the ceilings, meters on the walls.
void AddServices(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (const double y : {0.0, 12.0}) {
    for (const double side : {-0.75, -0.55, 0.7}) {
      AddPipe(builder, {2.1, y + side, 2.35}, {21.9, y + side, 2.3}, 0.05, 0.05, 8,
              side > 0.0 ? m.rust : m.white_metal);
    }
    builder.AddBox({12.0, y + 0.25, 2.38}, {19.5, 0.3, 0.06}, 0.0, m.metal);
    for (double x = 3.0; x < 21.0; x += random.Uniform(2.0, 6.0)) {
      const double side = random.Uniform() < 0.5 ? -0.9 : 0.9;
      builder.AddBox({x, y + side, random.Uniform(1.0, 1.5)}, {0.4, 0.12, random.Uniform(0.3, 0.6)},
                     0.0, m.metal);
    }
    for (double x = 4.0; x < 22.0; x += 6.0)
      builder.AddBox({x, y, kHeight - 0.08}, {0.9, 0.12, 0.08}, 0.0, m.lamp);
  }
}

// Boilers, tanks, pumps; shelves, bicycles and boxes in the store.
void AddPlant(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (const double y : {2.6, 5.2, 7.6}) {
    AddPipe(builder, {29.3, y, 0.0}, {29.3, y, 2.3}, 0.75, 0.75, 18, m.white_metal);
    AddPipe(builder, {29.3, y, 2.3}, {29.3, y, 3.3}, 0.12, 0.12, 10, m.metal);
  }
  AddPipe(builder, {24.0, 5.3, 0.75}, {24.0, 8.0, 0.75}, 0.6, 0.6, 16, m.rust);
  for (const double y : {4.9, 8.3})
    builder.AddBox({24.0, y - 0.2, 0.0}, {0.9, 0.2, 0.5}, 0.0, m.concrete);
  builder.AddBox({28.0, 13.6, 0.0}, {3.4, 0.9, 2.0}, 0.0, m.metal);
  builder.AddBox({26.0, -2.4, 0.0}, {2.2, 0.8, 1.5}, 0.0, m.white_metal);
  for (const double z : {2.7, 3.0})
    AddPipe(builder, {22.4, 3.0 * z - 4.0, z}, {30.8, 3.0 * z - 4.0, z}, 0.11, 0.11, 10,
            m.white_metal);
  for (double y = 1.8; y < 10.0; y += 2.1)
    AddShelf(builder, {{-5.75, y, 0.0}, 0.5 * std::numbers::pi}, 1.9, 1.9, m, random);
  for (const double y : {4.0, 6.6})
    AddShelf(builder, {{-0.5, y, 0.0}, -0.5 * std::numbers::pi}, 1.8, 1.9, m, random);
  AddClutter(builder, {{-4.9, -2.0, 0.0}}, 0.8, 10, m, random);
  AddClutter(builder, {{-4.8, 13.4, 0.0}}, 0.8, 10, m, random);
  AddBicycle(builder, {{-2.4, 14.1, 0.0}, 0.1}, m);
  for (const double y : {3.0, 9.2})
    builder.AddBox({-3.0, y, 0.0}, {0.4, 0.4, kHeight}, 0.0, m.concrete);
}

std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps = {{26.6, 1.5, 3.2}, {26.6, 9.0, 3.2}, {-2.6, 6.0, 2.4}};
  for (const double y : {0.0, 12.0}) {
    for (double x = 4.0; x < 22.0; x += 6.0) lamps.emplace_back(x, y, kHeight - 0.15);
  }
  return lamps;
}

}  // namespace

Place MakeBasement(std::uint64_t seed) {
  RandomStream random(seed, "basement");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddRooms(builder, m, random);
  AddServices(builder, m, random);
  AddPlant(builder, m, random);
  Lighting lighting = Indoors(60.0, Lamps());
  lighting.sun_illuminance = lighting.sky_illuminance = 0.0;  // below ground
  return {.world = World(std::move(builder).Finish(), std::move(lighting)),
          .path = WalkAt(kHandheldHeight,
                         {{-1.2, 0.0, 0.0},
                          {22.1, 0.0, 0.0},
                          {24.5, 0.3, 0.0},
                          {26.6, 3.0, 0.0},
                          {26.6, 9.5, 0.0},
                          {24.5, 12.0, 0.0},
                          {22.1, 12.0, 0.0},
                          {-0.5, 12.0, 0.0},
                          {-2.0, 11.5, 0.0},
                          {-1.9, 9.0, 0.0},
                          {-1.9, 4.0, 0.0},
                          {-2.4, 1.0, 0.0},
                          {-2.0, 0.2, 0.0}},
                         0.35)};
}

}  // namespace mlvi

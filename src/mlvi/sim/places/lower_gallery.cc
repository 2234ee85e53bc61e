// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/theatre.h"

namespace mlvi {
namespace {

constexpr double kFloor = kLowerGallery;
constexpr double kWest = kTheatreRadius + 0.3, kEast = kWest + 34.0;        // m, corridor
constexpr double kSouth = kGalleryDoor - 1.0, kNorth = kGalleryDoor + 1.0;  // m
constexpr double kHeight = 2.7;                                             // m

// A bare corridor whose doors are all alike, with a lobby at its far end.
void AddCorridor(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  WallHoles holes{.east = {FramedPassage(kGalleryDoor - 0.6, kGalleryDoor + 0.6, 2.1, m.frame)},
                  .west = {Passage(kGalleryDoor - 0.55, kGalleryDoor + 0.55, 2.2)}};
  for (double x = kWest + 4.0; x < kEast - 3.0; x += 7.5) {
    holes.south.push_back(Door(x + random.Uniform(-0.1, 0.1), m.door, m.frame, 0.04));
    holes.north.push_back(Door(x + 3.75 + random.Uniform(-0.1, 0.1), m.door, m.frame, 0.04));
  }
  AddRoom(builder, {kWest, kSouth, kFloor}, {kEast, kNorth, kFloor + kHeight},
          Painted(m.plaster, m.carpet, m.ceiling), holes);
  for (double x = kWest + 3.0; x < kEast; x += 6.0)
    builder.AddBox({x, kGalleryDoor, kFloor + kHeight - 0.05}, {0.5, 0.5, 0.05}, 0.0, m.lamp);
  AddPicture(builder, {{kWest + 16.0, kNorth - 0.03, kFloor + 1.2}}, 0.8, 0.6, m.posters);
}

void AddLobby(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const Eigen::Vector3d low(kEast + 0.2, -4.6, kFloor), high(kEast + 6.4, 2.8, kFloor + 3.2);
  AddRoom(builder, low, high, Painted(m.paint, m.flagstone, m.ceiling),
          {.east = {Window(-2.2, 1.5, 1.6, m.window), Window(0.6, 1.5, 1.6, m.window)},
           .north = {Door(kEast + 2.5, m.dark_wood, m.frame)},
           .west = {Passage(kGalleryDoor - 0.6, kGalleryDoor + 0.6, 2.1)}});
  AddBench(builder, {{kEast + 3.2, 2.4, kFloor}}, m);
  AddTable(builder, {{kEast + 3.5, -4.1, kFloor}, 0.05}, {1.6, 0.6, 0.8}, m);
  AddClutter(builder, {{kEast + 5.8, -4.0, kFloor}}, 0.4, 4, m, random);
  builder.AddColumn({kEast + 5.0, 1.5, kFloor}, 0.2, 3.2, 14, m.stone);
}

std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps = {{kEast + 3.3, -0.9, kFloor + 3.0}};
  for (double x = kWest + 3.0; x < kEast; x += 6.0)
    lamps.emplace_back(x, kGalleryDoor, kFloor + kHeight - 0.12);
  for (const double x : {-6.0, 0.0, 6.0}) lamps.emplace_back(x, 0.0, kTheatreCeiling - 1.0);
  return lamps;
}

}  // namespace

Place MakeLowerGallery(std::uint64_t seed) {
  RandomStream random(seed, "lower gallery");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddTheatre(builder, kLowerGallery, m, random);
  AddCorridor(builder, m, random);
  AddLobby(builder, m, random);
  // From the lobby along the corridor, round the gallery, and all the way back.
  const double y = kGalleryDoor;
  std::vector<Eigen::Vector3d> walk = {{kEast + 3.6, -0.9, kFloor},
                                       {kEast + 0.1, y + 0.05, kFloor}};
  const auto append = [&](const std::vector<Eigen::Vector3d>& points) {
    walk.insert(walk.end(), points.begin(), points.end());
  };
  append(GalleryWalk(9.45, kFloor, 2.7, false));
  append(GalleryWalk(10.15, kFloor, 2.7, true));
  append({{kEast + 0.1, y - 0.05, kFloor},
          {kEast + 2.0, -2.2, kFloor},
          {kEast + 4.2, -2.4, kFloor},
          {kEast + 4.6, -1.4, kFloor}});
  return {.world = World(std::move(builder).Finish(), Indoors(40.0, Lamps())),
          .path = WalkAt(kHandheldHeight, walk, 0.3)};
}

}  // namespace mlvi

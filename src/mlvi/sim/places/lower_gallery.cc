// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/theatre.h"

namespace mlvi {
namespace {

constexpr double kFloor = kLowerGallery;
constexpr double kWest = kTheatreRadius + 0.3, kEast = kWest + 38.0;  // m, corridor
constexpr double kMiddle = -3.05, kHalf = 1.0;                        // m, across it
constexpr double kHeight = 2.7;                                       // m
constexpr double kFrameWidth = 0.05, kFrameDepth = 0.04, kGlassHeight = kHeight - 0.05;  // m, ends
constexpr double kVestibule = kWest + 1.0;  // m, x of the way between corridor and gallery

// One end of the corridor, at `x`: dark glass from wall to wall in a slim frame, two panes that meet
// `side` (1: east, -1: west) of it at an angle, so that nothing glints along the corridor.
void AddGlassEnd(MeshBuilder& builder, double x, double side, const Palette& m) {
  const double frame = x + side * kFrameDepth, ridge = frame + side * 0.2;
  const double half = kHalf - kFrameWidth, low = kFloor, high = kFloor + kGlassHeight;
  const Eigen::Vector3d south(frame, kMiddle - half, low), middle(ridge, kMiddle, low),
      north(frame, kMiddle + half, low), up(0.0, 0.0, high - low);
  builder.AddQuad(south, middle, middle + up, south + up, m.dark_glass);
  builder.AddQuad(middle, north, north + up, middle + up, m.dark_glass);
  builder.AddTriangle(south, middle, north, m.carpet);
  builder.AddTriangle(south + up, middle + up, north + up, m.ceiling);
}

// A bare corridor: doors are flush with its walls to 3 mm and painted like them, lamps with the
// ceiling, its ends are glass. Little tells a LiDAR the motion along it: slim frames at the ends,
// glass when near, the ways out aside (the lobby in the south, a vestibule before the gallery in the
// north), and waves of the plaster.
void AddCorridor(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  WallHoles holes{.south = {FramedPassage(kEast - 1.9, kEast - 0.3, 2.2, m.dark_glass)},
                  .north = {FramedPassage(kVestibule - 0.6, kVestibule + 0.6, 2.2, m.dark_glass)}};
  for (double x = kWest + 4.0; x < kEast - 5.0; x += 7.5) {
    const double shift = random.Uniform(-0.1, 0.1);
    holes.south.push_back(Door(x + shift, m.paint, m.paint, 0.003));
    holes.north.push_back(Door(x + 3.75 - shift, m.paint, m.paint, 0.003));
  }
  const PanelHole end{.u0 = kMiddle - kHalf + kFrameWidth,
                      .u1 = kMiddle + kHalf - kFrameWidth,
                      .v0 = 0.0,
                      .v1 = kGlassHeight,
                      .depth = kFrameDepth,
                      .open = true};
  holes.east = holes.west = {end};
  AddRoom(builder, {kWest, kMiddle - kHalf, kFloor}, {kEast, kMiddle + kHalf, kFloor + kHeight},
          {m.plaster, m.frame, m.plaster, m.frame, m.carpet, m.ceiling}, holes);
  AddGlassEnd(builder, kWest, -1.0, m);
  AddGlassEnd(builder, kEast, 1.0, m);
  for (double x = kWest + 3.0; x < kEast; x += 6.0)
    builder.AddBox({x, kMiddle, kFloor + kHeight - 0.002}, {0.5, 0.5, 0.002}, 0.0, m.lamp);
  AddRoom(builder, {kWest, kMiddle + kHalf + 0.2, kFloor}, {kWest + 2.0, 0.1, kFloor + kHeight},
          Painted(m.paint, m.carpet, m.ceiling),
          {.south = {Passage(kVestibule - 0.6, kVestibule + 0.6, 2.2)},
           .west = {Passage(kGalleryDoor - 0.55, kGalleryDoor + 0.55, 2.2)}});
}

void AddLobby(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const double north = kMiddle - kHalf - 0.2;
  const Eigen::Vector3d low(kEast - 4.0, north - 6.4, kFloor),
      high(kEast + 2.2, north, kFloor + 3.2);
  AddRoom(
      builder, low, high, Painted(m.paint, m.flagstone, m.ceiling),
      {.south = {Door(kEast - 1.5, m.dark_wood, m.frame)},
       .east = {Window(north - 4.8, 1.5, 1.6, m.window), Window(north - 1.8, 1.5, 1.6, m.window)},

       .north = {Passage(kEast - 1.9, kEast - 0.3, 2.2)}});
  AddBench(builder, {{kEast - 3.4, north - 3.0, kFloor}, 0.5 * std::numbers::pi}, m);
  AddTable(builder, {{kEast + 1.5, north - 3.5, kFloor}, 1.5}, {1.6, 0.6, 0.8}, m);
  AddClutter(builder, {{kEast - 3.2, north - 5.8, kFloor}}, 0.4, 4, m, random);
  builder.AddColumn({kEast + 1.2, north - 5.2, kFloor}, 0.2, 3.2, 14, m.stone);
}

std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps = {{kEast - 0.9, kMiddle - 4.0, kFloor + 3.0},
                                        {kVestibule, -1.0, kFloor + 2.5}};
  for (double x = kWest + 3.0; x < kEast; x += 6.0)
    lamps.emplace_back(x, kMiddle, kFloor + kHeight - 0.12);
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
  const double out = kMiddle + 0.05, back = kMiddle - 0.05, door = kEast - 1.1;
  std::vector<Eigen::Vector3d> walk = {{door + 0.2, kMiddle - 3.4, kFloor},
                                       {door, kMiddle - kHalf, kFloor},
                                       {door - 0.3, out, kFloor},
                                       {kVestibule + 0.2, out, kFloor},
                                       {kVestibule, kMiddle + kHalf, kFloor},
                                       {kVestibule - 0.1, kGalleryDoor, kFloor}};
  const auto append = [&](const std::vector<Eigen::Vector3d>& points) {
    walk.insert(walk.end(), points.begin(), points.end());
  };
  append(GalleryWalk(9.45, kFloor, 2.7, false));
  append(GalleryWalk(10.15, kFloor, 2.7, true));
  append({{kVestibule, kGalleryDoor, kFloor},
          {kVestibule, kMiddle + kHalf, kFloor},
          {kVestibule + 0.3, back, kFloor},
          {door - 0.2, back, kFloor},
          {door - 0.1, kMiddle - kHalf, kFloor},
          {door - 0.2, kMiddle - 3.6, kFloor},
          {door - 1.0, kMiddle - 5.4, kFloor},
          {door + 0.6, kMiddle - 5.6, kFloor}});
  return {.world = World(std::move(builder).Finish(), Indoors(40.0, Lamps())),
          .path = WalkAt(kHandheldHeight, walk, 0.3)};
}

}  // namespace mlvi

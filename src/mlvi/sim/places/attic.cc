// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/arcade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/theatre.h"

namespace mlvi {
namespace {

// The attic beside the theatre, and the narrow stairs from it down to the upper gallery: two
// flights around a wall, between the theatre and the attic.
constexpr double kFloor = 11.6, kLength = 24.0, kHalf = 4.2;                            // m, attic
constexpr double kShaftWest = kTheatreRadius + 0.3, kShaftEast = kTheatreRadius + 3.4;  // m
constexpr double kSouth = -1.8, kNorth = 5.6;                                           // m, shaft
constexpr double kWest = kShaftEast + 0.2;  // m, where the attic begins
constexpr int kSteps = 15;                  // of each flight
constexpr double kRise = (kFloor - kUpperGallery) / (2.0 * kSteps), kRun = 0.27;
constexpr double kHead = kSteps * kRun, kMiddle = kUpperGallery + kSteps * kRise;

void AddAttic(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  builder.AddPanel({{kWest, -kHalf, kFloor}, x, y, kLength, 2.0 * kHalf}, m.floorboards);
  AddTimberRoof(builder, {kWest, kHalf, kFloor + 0.25}, x, kLength, 2.0 * kHalf, 4.4, 1.0,
                {m.dark_wood, m.wood}, random);
  for (const double side : {-1.0, 1.0})
    builder.AddPanel({{kWest, side * kHalf, kFloor}, x, z, kLength, 0.45}, m.brick);
  builder.AddPanel({{kWest + kLength, -kHalf, kFloor}, y, z, 2.0 * kHalf, 5.0}, m.brick,
                   {{3.7, 4.7, 1.2, 2.6, 0.2, false, m.window}});
  builder.AddPanel({{kWest, -kHalf, kFloor}, y, z, 2.0 * kHalf, 5.0}, m.brick,
                   {Passage(kHalf + kGalleryDoor - 0.55, kHalf + kGalleryDoor + 0.55, 2.2)});
  builder.AddBox({kWest + 9.0, 1.7, kFloor}, {0.9, 0.8, 4.0}, 0.0, m.brick);  // chimneys
  builder.AddBox({kWest + 17.0, -1.8, kFloor}, {1.0, 0.8, 4.0}, 0.05, m.brick);
  for (double s = 3.0; s < kLength - 1.0; s += random.Uniform(2.0, 3.6)) {
    const double side = random.Uniform() < 0.5 ? -1.0 : 1.0;
    AddClutter(builder, {{kWest + s, side * 2.7, kFloor}}, 0.8, 6, m, random);
  }
  for (double s = 6.0; s < kLength; s += 8.0)
    builder.AddBox({kWest + s, 0.0, kFloor + 3.6}, {0.2, 0.2, 0.2}, 0.0, m.lamp);
}

void AddShaft(MeshBuilder& builder, const Palette& m) {
  const double width = 1.4, middle = 0.5 * (kShaftWest + kShaftEast);
  PanelHole above = FramedPassage(kGalleryDoor - 0.55, kGalleryDoor + 0.55, 2.2, m.frame);
  above.v0 += kFloor - kUpperGallery;
  above.v1 += kFloor - kUpperGallery;
  AddRoom(builder, {kShaftWest, kSouth, kUpperGallery}, {kShaftEast, kNorth, kFloor + 2.6},
          Painted(m.plaster, m.wood, m.ceiling),
          {.east = {above}, .west = {Passage(kGalleryDoor - 0.55, kGalleryDoor + 0.55, 2.2)}});
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  builder.AddStairs({kShaftWest, 0.0, kUpperGallery}, up, width, kSteps, kRun, kRise, m.wood);
  builder.AddStairs({kShaftEast, kHead, kMiddle}, -up, width, kSteps, kRun, kRise, m.wood);
  builder.AddBox({middle, 0.5 * (kHead + kNorth), kMiddle - 0.15},
                 {kShaftEast - kShaftWest, kNorth - kHead, 0.15}, 0.0, m.floorboards);
  builder.AddBox({middle, 0.5 * kSouth, kFloor - 0.15}, {kShaftEast - kShaftWest, -kSouth, 0.15},
                 0.0, m.floorboards);
  builder.AddBox({middle, 0.5 * kHead, kUpperGallery},
                 {kShaftEast - kShaftWest - 2.0 * width, kHead, kFloor + 2.6 - kUpperGallery}, 0.0,
                 m.plaster);
}

// From the attic down to the door of the gallery.
std::vector<Eigen::Vector3d> WayDown() {
  const double west = kShaftWest + 0.7, east = kShaftEast - 0.7, front = -0.9, back = kHead + 0.75;
  return {{kWest + 2.0, -0.8, kFloor}, {kWest, kGalleryDoor, kFloor}, {east, front, kFloor},
          {east, 0.0, kFloor},         {east, kHead, kMiddle},        {east, back, kMiddle},
          {west, back, kMiddle},       {west, kHead, kMiddle},        {west, 0.0, kUpperGallery},
          {west, front, kUpperGallery}};
}

std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps = {{12.9, -0.9, 8.6}, {12.9, 4.8, 11.5}, {12.9, -0.9, 13.9}};
  for (double s = 6.0; s < kLength; s += 8.0) lamps.emplace_back(kWest + s, 0.0, kFloor + 3.4);
  for (const double x : {-6.0, 0.0, 6.0}) lamps.emplace_back(x, 0.0, kTheatreCeiling - 1.0);
  return lamps;
}

}  // namespace

Place MakeAttic(std::uint64_t seed) {
  RandomStream random(seed, "attic");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddTheatre(builder, kUpperGallery, m, random);
  AddAttic(builder, m, random);
  AddShaft(builder, m);
  // From the far end of the attic down and along the gallery, and all the way back.
  std::vector<Eigen::Vector3d> walk = {
      {kWest + 21.0, 0.75, kFloor}, {kWest + 6.5, 0.75, kFloor}, {kWest + 5.5, -0.75, kFloor}};
  const auto append = [&](const std::vector<Eigen::Vector3d>& points) {
    walk.insert(walk.end(), points.begin(), points.end());
  };
  const std::vector<Eigen::Vector3d> way = WayDown();
  append(way);
  append(GalleryWalk(9.75, kUpperGallery, 2.6, false));
  append(GalleryWalk(10.35, kUpperGallery, 2.6, true));
  append({way.rbegin(), way.rend()});
  append({{kWest + 12.0, -0.75, kFloor}, {kWest + 21.0, -0.75, kFloor}});
  return {.world = World(std::move(builder).Finish(), Indoors(25.0, Lamps())),
          .path = WalkAt(kHandheldHeight, walk, 0.3)};
}

}  // namespace mlvi

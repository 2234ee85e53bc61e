// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/palette.h"
#include "mlvi/sim/places/rooms.h"
#include "mlvi/sim/places/shapes.h"

namespace mlvi {
namespace {

// Flights of kSteps steps either side of a solid wall, landings before and behind. The first flight
// of a storey climbs along +y in the east, the second comes back in the west.
constexpr int kStoreys = 5, kSteps = 10;
constexpr double kRun = 0.28, kRise = 0.16;
constexpr double kFlight = kSteps * kRun, kHalfStorey = kSteps * kRise;
constexpr double kWidth = 1.0, kCore = 0.2, kLanding = 1.1;  // m
constexpr double kEast = 2.0 * kWidth + kCore, kNorth = 2.0 * kLanding + kFlight;
constexpr double kTop = 2.0 * kStoreys * kHalfStorey;  // m, the uppermost floor
constexpr double kHead = 2.9;                          // m above the uppermost floor

void AddFlights(MeshBuilder& builder, const Palette& m) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  for (int storey = 0; storey < kStoreys; ++storey) {
    const double z = 2.0 * kHalfStorey * storey, middle = z + kHalfStorey;
    builder.AddStairs({kWidth + kCore, kLanding, z}, up, kWidth, kSteps, kRun, kRise, m.concrete);
    builder.AddStairs({kWidth, kLanding + kFlight, middle}, -up, kWidth, kSteps, kRun, kRise,
                      m.concrete);
    builder.AddBox({0.5 * kEast, kNorth - 0.5 * kLanding, middle - 0.15}, {kEast, kLanding, 0.15},
                   0.0, m.concrete);
    builder.AddBox({0.5 * kEast, 0.5 * kLanding, z + 2.0 * kHalfStorey - 0.15},
                   {kEast, kLanding, 0.15}, 0.0, m.concrete);
    // Handrails along the outer walls.
    const double rail = 0.9;
    AddBeam(builder, {kEast - 0.06, kLanding, z + rail},
            {kEast - 0.06, kLanding + kFlight, middle + rail}, 0.04, 0.04, m.dark_wood);
    AddBeam(builder, {0.06, kLanding + kFlight, middle + rail},
            {0.06, kLanding, z + 2.0 * kHalfStorey + rail}, 0.04, 0.04, m.dark_wood);
  }
  builder.AddBox({kWidth + 0.5 * kCore, kLanding + 0.5 * kFlight, 0.0},
                 {kCore, kFlight, kTop + kHead}, 0.0, m.plaster);
}

// The shaft: bare walls, glazed behind, so that a LiDAR misses what would tell the motion along the
// flights; a glass door on the landings in front.
void AddShaft(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  WallHoles holes{.south = {FramedPassage(0.2, 1.3, 2.1, m.frame)}};
  for (int storey = 1; storey < kStoreys; ++storey) {
    PanelHole door = Door(0.25 + random.Uniform(0.0, 0.1), m.dark_glass, m.dark_glass, 0.03);
    door.v0 += 2.0 * kHalfStorey * storey;
    door.v1 += 2.0 * kHalfStorey * storey;
    holes.south.push_back(door);
  }
  PanelHole top = FramedPassage(0.2, 1.3, 2.1, m.frame);
  top.v0 += kTop;
  top.v1 += kTop;
  holes.south.push_back(top);
  AddRoom(builder, {0.0, 0.0, 0.0}, {kEast, kNorth, kTop + kHead},
          {m.plaster, m.plaster, m.dark_glass, m.plaster, m.concrete, m.ceiling}, holes);
  for (double z = 1.0; z < kTop + kHead; z += kHalfStorey) {  // transoms of the glazing
    AddBeam(builder, {0.0, kNorth - 0.03, z}, {kEast, kNorth - 0.03, z}, 0.05, 0.06, m.dark_wood);
  }
}

// Lobbies before the bottom and the top of the stairs: doors and windows, as bare as the shaft.
void AddLobbies(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (const double z : {0.0, kTop}) {
    const WallHoles holes{.south = {Window(-1.0 + random.Uniform(-0.3, 0.3), 1.6, 1.5, m.window),
                                    Window(2.4, 1.4, 1.5, m.window)},
                          .east = {Door(-3.5, m.door, m.frame)},
                          .north = {Passage(0.2, 1.3, 2.1)},
                          .west = {Door(-5.0 + random.Uniform(0.0, 0.6), m.dark_wood, m.frame)}};
    AddRoom(builder, {-3.2, -6.4, z}, {4.6, -0.2, z + 2.9},
            Painted(m.paint, m.floorboards, m.ceiling), holes);
  }
}

// The way up; the sensor stays in the middle of the flights.
std::vector<Eigen::Vector3d> WayUp() {
  const double west = 0.5 * kWidth, east = kEast - west;
  const double front = 0.55 * kLanding, back = kNorth - front;
  std::vector<Eigen::Vector3d> way = {{0.75, -0.9, 0.0}, {0.75, 0.3, 0.0}, {1.2, front, 0.0}};
  for (int storey = 0; storey < kStoreys; ++storey) {
    const double z = 2.0 * kHalfStorey * storey, middle = z + kHalfStorey;
    way.insert(way.end(), {{east, front, z},
                           {east, kLanding, z},
                           {east, kLanding + kFlight, middle},
                           {east, back, middle},
                           {west, back, middle},
                           {west, kLanding + kFlight, middle},
                           {west, kLanding, z + 2.0 * kHalfStorey},
                           {west, front, z + 2.0 * kHalfStorey}});
  }
  way.insert(way.end(), {{0.75, 0.3, kTop}, {0.75, -0.9, kTop}});
  return way;
}

// One under the ceiling of each landing in front, and in the rooms.
std::vector<Eigen::Vector3d> Lamps() {
  std::vector<Eigen::Vector3d> lamps = {{0.7, -3.2, 2.7}, {0.7, -3.2, kTop + 2.7}};
  for (int storey = 0; storey <= kStoreys; ++storey)
    lamps.emplace_back(0.5 * kEast, 0.4 * kLanding, 2.0 * kHalfStorey * storey + 2.6);
  return lamps;
}

}  // namespace

Place MakeStairwell(std::uint64_t seed) {
  RandomStream random(seed, "stairwell");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddFlights(builder, m);
  AddShaft(builder, m, random);
  AddLobbies(builder, m, random);
  const std::vector<Eigen::Vector3d> up = WayUp();
  std::vector<Eigen::Vector3d> walk = {{-0.9, -4.6, 0.0}, {1.0, -4.4, 0.0}, {1.6, -2.4, 0.0}};
  walk.insert(walk.end(), up.begin(), up.end());
  walk.insert(walk.end(),
              {{0.3, -2.2, kTop}, {-0.7, -3.8, kTop}, {1.4, -4.3, kTop}, {1.5, -2.2, kTop}});
  walk.insert(walk.end(), up.rbegin(), up.rend());
  walk.insert(walk.end(), {{0.2, -2.0, 0.0}, {-1.0, -3.2, 0.0}});
  return {.world = World(std::move(builder).Finish(), Indoors(60.0, Lamps())),
          .path = WalkAt(kHandheldHeight, walk, 0.22)};
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "mlvi/sim/mesh_builder.h"
#include "mlvi/sim/places.h"
#include "mlvi/sim/places/rooms.h"

namespace mlvi {
namespace {

constexpr double kCarried = 1.4;  // m, height of the sensor above the floor

struct Materials {
  MaterialId wall, floor, ceiling, dark_glass, frame, door, furniture;
};

Materials AddMaterials(MeshBuilder& builder) {
  return {.wall = builder.AddMaterial("wall paint", 0.6),
          .floor = builder.AddMaterial("linoleum", 0.3),
          .ceiling = builder.AddMaterial("ceiling", 0.7),
          // So dark that a LiDAR sees it from nearby only: the ends of the corridor give no bearing
          // from its middle.
          .dark_glass = builder.AddMaterial("dark glass", 0.01),
          // Door frames face along the corridor: dark, so that they are not seen from afar either.
          .frame = builder.AddMaterial("door frame", 0.03),
          .door = builder.AddMaterial("door", 0.4),
          .furniture = builder.AddMaterial("furniture", 0.5)};
}

RoomMaterials Painted(const Materials& m) { return mlvi::Painted(m.wall, m.floor, m.ceiling); }

// Corridor along x, the lobby south of its beginning, joined by a passage in a wall of 0.2 m.
void AddCorridorAndLobby(MeshBuilder& builder, const Materials& m, RandomStream& random) {
  const auto door = [&](double x) { return Door(x + random.Uniform(-0.5, 0.5), m.door, m.frame); };
  const WallHoles corridor{
      .south = {FramedPassage(2.0, 4.4, 2.3, m.frame), door(24.0)},
      .north = {door(9.0), door(41.0), FramedPassage(51.2, 53.6, 2.3, m.frame)}};
  AddRoom(builder, {0.0, -1.2, 0.0}, {54.0, 1.2, 2.8},
          {m.wall, m.dark_glass, m.wall, m.dark_glass, m.floor, m.ceiling}, corridor);
  AddRoom(builder, {0.0, -9.4, 0.0}, {8.0, -1.4, 3.2}, Painted(m),
          {.north = {Passage(2.0, 4.4, 2.3)}});
  builder.AddBox({7.2, -3.0, 0.0}, {0.6, 2.0, 1.1}, random.Uniform(-0.2, 0.2), m.furniture);
  builder.AddBox({1.0, -8.6, 0.0}, {1.2, 0.7, 0.75}, random.Uniform(-0.3, 0.3), m.furniture);
  builder.AddColumn({4.3, -5.5, 0.0}, 0.2, 3.2, 16, m.wall);
}

// Four flights between near landings (z = 0, 3, 6) and far landings (z = 1.5, 4.5), around a wall.
void AddStairwell(MeshBuilder& builder, const Materials& m) {
  AddRoom(builder, {49.6, 1.4, 0.0}, {53.9, 7.6, 8.8}, Painted(m),
          {.south = {Passage(51.2, 53.6, 2.3)},
           .west = {{.u0 = 1.6, .u1 = 2.9, .v0 = 6.0, .v1 = 8.2, .depth = 0.2, .open = true}}});
  constexpr int kSteps = 10;
  constexpr double kRun = 0.29, kRise = 0.15;
  const Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  for (const double z : {0.0, 3.0}) {
    builder.AddStairs({51.85, 3.0, z}, up, 2.05, kSteps, kRun, kRise, m.floor);
    builder.AddStairs({51.65, 5.9, z + 1.5}, -up, 2.05, kSteps, kRun, kRise, m.floor);
    builder.AddBox({51.75, 6.75, z + 1.3}, {4.3, 1.7, 0.2}, 0.0, m.floor);
    builder.AddBox({51.75, 2.2, z + 2.8}, {4.3, 1.6, 0.2}, 0.0, m.floor);
  }
  builder.AddBox({51.75, 4.45, 0.0}, {0.2, 2.9, 7.0}, 0.0, m.wall);
  builder.AddBox({52.85, 3.0, 6.0}, {2.1, 0.06, 1.0}, 0.0,
                 m.wall);  // railing of the uppermost landing
}

void AddUpperRoom(MeshBuilder& builder, const Materials& m, RandomStream& random) {
  AddRoom(builder, {38.0, 1.4, 6.0}, {49.4, 9.6, 9.0}, Painted(m),
          {.east = {{.u0 = 1.6, .u1 = 2.9, .v0 = 0.0, .v1 = 2.2, .depth = 0.0, .open = true}}});
  const auto jitter = [&] { return random.Uniform(-0.2, 0.2); };
  builder.AddBox({44.0 + jitter(), 5.2 + jitter(), 6.0}, {2.4, 1.2, 0.75}, jitter(), m.furniture);
  builder.AddBox({42.5, 9.35, 6.0}, {3.0, 0.4, 2.0}, 0.0, m.furniture);
  builder.AddBox({38.3, 4.0 + jitter(), 6.0}, {0.5, 1.6, 1.8}, 0.0, m.furniture);
  builder.AddColumn({48.6, 8.7, 6.0}, 0.25, 3.0, 16, m.wall);
}

// The walk on the floor; the sensor is carried above it.
std::vector<Eigen::Vector3d> Waypoints() {
  const std::vector<Eigen::Vector3d> out = {
      {3.2, -1.3, 0.0}, {3.8, 0.0, 0.0},  {52.4, 0.0, 0.0},  {52.8, 2.2, 0.0},
      {52.8, 3.0, 0.0}, {52.8, 5.9, 1.5}, {52.8, 6.75, 1.5}, {50.6, 6.75, 1.5},
      {50.6, 5.9, 1.5}, {50.6, 3.0, 3.0}, {50.6, 2.25, 3.0}, {52.8, 2.25, 3.0},
      {52.8, 3.0, 3.0}, {52.8, 5.9, 4.5}, {52.8, 6.75, 4.5}, {50.6, 6.75, 4.5},
      {50.6, 5.9, 4.5}, {50.6, 3.0, 6.0}, {50.6, 2.25, 6.0}, {47.8, 2.25, 6.0}};
  const std::vector<Eigen::Vector3d> room = {
      {41.0, 2.5, 6.0}, {40.2, 5.0, 6.0}, {41.2, 7.6, 6.0}, {46.3, 7.6, 6.0}, {47.2, 5.0, 6.0}};
  const std::vector<Eigen::Vector3d> lobby = {{2.6, -3.0, 0.0}, {2.2, -6.5, 0.0}, {5.5, -7.6, 0.0}};
  std::vector<Eigen::Vector3d> walk = {{5.8, -5.5, 0.0}, {4.4, -3.2, 0.0}};
  walk.insert(walk.end(), out.begin(), out.end());
  walk.insert(walk.end(), room.begin(), room.end());
  walk.insert(walk.end(), out.rbegin(), out.rend());
  walk.insert(walk.end(), lobby.begin(), lobby.end());
  for (Eigen::Vector3d& p : walk) p.z() += kCarried;
  return walk;
}

// A lamp below the ceiling every 5 m of the walk, each place once.
Lighting Lamps(const WalkingPath& path) {
  Lighting light{.sun_illuminance = 0.0, .sky_illuminance = 0.0, .ambient_illuminance = 15.0};
  for (double s = 0.0; s < path.length(); s += 1.0) {
    const Eigen::Vector3d at = path.At(s).position + Eigen::Vector3d(0.0, 0.0, 0.9);
    const bool lit = std::any_of(light.lamps.begin(), light.lamps.end(), [&](const PointLamp& l) {
      return (l.position - at).norm() < 5.0;
    });
    if (!lit) light.lamps.push_back({.position = at, .intensity = 250.0});
  }
  return light;
}

}  // namespace

Place MakeCorridor(std::uint64_t seed) {
  RandomStream random(seed, "corridor");
  MeshBuilder builder;
  const Materials m = AddMaterials(builder);
  AddCorridorAndLobby(builder, m, random);
  AddStairwell(builder, m);
  AddUpperRoom(builder, m, random);
  WalkingPath path(Waypoints(), 0.35);
  Lighting light = Lamps(path);
  return {.world = World(std::move(builder).Finish(), std::move(light)), .path = std::move(path)};
}

}  // namespace mlvi

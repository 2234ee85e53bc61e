// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The procedural worlds, each with a walk through it. Adding one: a function here, its source file,
// and a row in the catalogue of sequence.cc.
#pragma once

#include <cstdint>

#include "mlvi/sim/walking_path.h"
#include "mlvi/sim/world.h"

namespace mlvi {

// Heights of the body above the ground, m: carried in the hand, on a ground robot.
constexpr double kHandheldHeight = 1.4, kRobotHeight = 0.7;

struct Place {
  World world;
  WalkingPath path;  // of the body; starts on a straight stretch
};

// The walk of a body that is carried `height` m above the waypoints (WalkingPath).
WalkingPath WalkAt(double height, std::vector<Eigen::Vector3d> waypoints, double rounding);

// A quadrangle of 40 x 40 m between facades of 15-17 m with window recesses, pillars and doors;
// slightly uneven ground, trees and benches. The walk is a round of about 80 m.
Place MakeCourtyard(std::uint64_t seed);

// A lobby, a corridor of 54 x 2.4 m between two dark glass doors with three door recesses in all
// (so that a LiDAR cannot tell the motion along it over long stretches), a stairwell of four
// flights up, and a furnished room. The walk goes there and back, about 200 m; the way out is 5 m
// of lobby, 49 m of corridor, then stairs.
Place MakeCorridor(std::uint64_t seed);

// --- The places of the Newer College sequences (handheld) ---

// A quadrangle of 44 x 36 m between old facades and a chapel, a gate tower, a lawn with a statue,
// trees and borders. Once round, across the lawn, back along two sides the other way round.
Place MakeQuad(std::uint64_t seed);
// A plaza and a court either side of a wing with a glass front, an arcade and a passage under it,
// which is walked both ways.
Place MakeMathInstitute(std::uint64_t seed);
// Rough galleries about 2.8 m wide and 2.5 m high in a round of 90 m with a cross-cut, two of them
// sawn smooth; dark.
Place MakeMine(std::uint64_t seed);
// Five storeys of flights 1 m wide around a solid wall, bare and alike, between two bare lobbies.
// Nearly all that a LiDAR sees there is nearer than a metre or two.
Place MakeStairwell(std::uint64_t seed);
// Four walks of 26 m around a court, alike but for details: arcade on one side, bare wall on the
// other, timber roof.
Place MakeCloister(std::uint64_t seed);

// --- The places of the M2DGR sequences (ground robot) ---

// A laboratory of 11 x 8.6 m: desks, shelves, motion-capture cameras, and `variant` (1 to 3) people
// walking about. The robot's round differs between variants.
Place MakeRoom(std::uint64_t seed, int variant);
// A hall of 44 x 22 m with walls of glass on two sides and a gallery.
Place MakeHall(std::uint64_t seed);
// A corridor and a foyer with a glass front, its door, a forecourt with cars.
Place MakeDoor(std::uint64_t seed);
// A campus gate between a street and an avenue with trees and lamps.
Place MakeGate(std::uint64_t seed);
// A street of 120 m with parked and moving cars, pedestrians, front gardens, trees.
Place MakeStreet(std::uint64_t seed);

// --- The places of the Hilti 2022 sequences (handheld) ---

// An upper storey in the raw: slabs, columns, props, stacks of material, open to all sides.
Place MakeConstruction(std::uint64_t seed);
// Narrow passages under pipes, a plant room, a store; dim.
Place MakeBasement(std::uint64_t seed);
// An attic of beams, narrow stairs, the upper gallery of a theatre.
Place MakeAttic(std::uint64_t seed);
// A bare corridor of 34 m and the lower gallery of the same theatre.
Place MakeLowerGallery(std::uint64_t seed);

}  // namespace mlvi

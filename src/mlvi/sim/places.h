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

struct Place {
  World world;
  WalkingPath path;  // of the body, 1.4 m above the ground; starts on a straight stretch
};

// A quadrangle of 40 x 40 m between facades of 15-17 m with window recesses, pillars and doors;
// slightly uneven ground, trees and benches. The walk is a round of about 80 m.
Place MakeCourtyard(std::uint64_t seed);

// A lobby, a corridor of 54 x 2.4 m between two dark glass doors with three door recesses in all
// (so that a LiDAR cannot tell the motion along it over long stretches), a stairwell of four
// flights up, and a furnished room. The walk goes there and back, about 200 m; the way out is 5 m
// of lobby, 49 m of corridor, then stairs.
Place MakeCorridor(std::uint64_t seed);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What moves: people and vehicles on closed ways.
#pragma once

#include "mlvi/sim/places/palette.h"
#include "mlvi/sim/walking_path.h"

namespace mlvi {

// Motion along `path` (closed, on the ground).
struct Way {
  WalkingPath path;
  double speed = 1.2;  // m/s
  double start = 0.0;  // m along the path at the beginning of the recording
};

// A person of 1.6 to 1.9 m with swinging arms and legs; height, build and clothes are drawn.
MovingObject MakePedestrian(const std::string& name, Way way, RandomStream& random);

// A car or (`van`) a delivery van.
MovingObject MakeVehicle(const std::string& name, Way way, bool van, RandomStream& random);

// The way there and back between two points of the ground, `apart` m between the two directions.
Way ThereAndBack(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double apart, double speed,
                 double start);

}  // namespace mlvi

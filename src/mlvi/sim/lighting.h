// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The light of a world, in photometric units: a sunny day has about 80000 lux from the sun and
// 15000 from the sky, an overcast one 10000, an office 300 to 500, a corridor at night 5.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace mlvi {

// Shines evenly in all directions; casts (soft) shadows.
struct PointLamp {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, world
  double intensity = 100.0;                            // cd; 100 cd give 25 lux at 2 m
};

struct Lighting {
  Eigen::Vector3d sun_direction = Eigen::Vector3d(0.4, 0.25, 0.88).normalized();  // to the sun
  double sun_illuminance = 60000.0;  // lux on a surface that faces it; 0: no sun
  double sky_illuminance = 12000.0;  // lux on open level ground, from the whole sky; 0: night
  // lux everywhere: stands for light that comes round many corners. Never quite 0 in a real place.
  double ambient_illuminance = 0.0;
  std::vector<PointLamp> lamps = {};
  // What all lamps and lamp shades give at a time (s after the beginning of the recording), relative
  // to their intensity; empty: always 1. Same time, same value; called from many threads.
  std::function<double(double seconds)> lamp_level = {};
  // A lamp on the rig that lights all around, cd; 0: none. Casts no shadows.
  double carried_lamp_intensity = 0.0;
};

}  // namespace mlvi

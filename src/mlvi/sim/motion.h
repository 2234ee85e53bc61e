// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "mlvi/geometry/spline.h"
#include "mlvi/sim/walking_path.h"

namespace mlvi {

// How a person walks and carries the sensor, or how a robot drives.
struct MotionProfile {
  double speed = 1.2;  // m/s on straight stretches
  Duration knot_interval = Duration::FromMilliseconds(50);
  double rest = 2.0;               // s without any motion at the beginning; 0 starts in full motion
  double look_around = 0.18;       // rad, amplitude of slow turns of the sensor
  double heading_smoothing = 1.0;  // s, how long before and after a corner the walker turns
  // A person who stands looks round towards the next corner; a robot that stands does not turn:
  // its smoothing counts time in motion only.
  bool turns_at_rest = true;
  double peak_rate = 0.0;          // rad/s, to which shaking is scaled; 0: no shaking
  double peak_acceleration = 0.0;  // m/s^2, likewise
  // Shaking swells and fades: its least strength relative to the bursts, and how short these are.
  double calm = 0.3;
  int burst_sharpness = 1;     // power of the wave
  double gait = 1.0;           // scale of the swaying of steps; 0: on wheels
  double stair_slowing = 0.0;  // on a slope the speed is divided by 1 + stair_slowing * |slope|
  double stair_bob = 0.0;      // and the bobbing is multiplied by 1 + stair_bob * |slope|
  double vibration = 0.0;      // m/s^2, amplitude of the shaking of wheels on the ground
  double pause_every = 0.0;    // s of motion between stops; 0: no stops
  double pause = 0.0;          // s of each stop, besides a second to slow down and to start
};

// A calm walk: angular rates of Newer College "quad-easy" (mean 13, p95 26, max about 51 deg/s).
MotionProfile EasyMotion();
// A brisk walk, the sensor pointed here and there: up to 1.7 rad/s and 5 m/s^2.
MotionProfile MediumMotion();
// Aggressive handheld motion: rates up to 3.5 rad/s, accelerations up to 9 m/s^2.
MotionProfile HardMotion();
// A calm walk that slows down on stairs to about 0.6 m/s, where each step is felt.
MotionProfile StairsMotion();
// The Hilti handheld on a survey (RIGS 4.4: exp04/05, p95 64, max 145 deg/s at 0.6 m/s), with
// stops.
MotionProfile SurveyMotion();
// The same shaken (exp06: p95 132, max 264 deg/s).
MotionProfile HastySurveyMotion();
// A ground robot (M2DGR hall_03: 0.77 m/s, height constant to centimetres), with stops.
MotionProfile RobotMotion();
// The same within a room: 0.5 m/s.
MotionProfile SlowRobotMotion();

// The motion of the body along `path` during [begin, begin + seconds]. `R_carrier_body` places the
// body in the carrier's frame (x ahead, y left, z up). Same arguments, same motion.
PoseSpline MakeWalk(const WalkingPath& path, const MotionProfile& profile,
                    const Eigen::Quaterniond& R_carrier_body, Time begin, double seconds,
                    std::uint64_t seed);

struct MotionStatistics {
  double mean_rate = 0.0, p95_rate = 0.0, max_rate = 0.0;  // rad/s
  double mean_speed = 0.0;                                 // m/s
  double max_acceleration = 0.0;                           // m/s^2, without gravity
};
// Sampled every 5 ms over [from, to], inside the spline.
MotionStatistics MeasureMotion(const PoseSpline& spline, Time from, Time to);

}  // namespace mlvi

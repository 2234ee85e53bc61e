// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "mlvi/geometry/spline.h"
#include "mlvi/sim/walking_path.h"

namespace mlvi {

// How a person walks and carries the sensor.
struct MotionProfile {
  double speed = 1.2;  // m/s on straight stretches
  Duration knot_interval = Duration::FromMilliseconds(50);
  double rest = 2.0;               // s without any motion at the beginning; 0 starts in full motion
  double look_around = 0.18;       // rad, amplitude of slow turns of the sensor
  double heading_smoothing = 1.0;  // s, how long before and after a corner the walker turns
  double peak_rate = 0.0;          // rad/s, to which shaking is scaled; 0: no shaking
  double peak_acceleration = 0.0;  // m/s^2, likewise
};

// A calm walk: angular rates of Newer College "quad-easy" (mean 13, p95 26, max about 51 deg/s).
MotionProfile EasyMotion();
// Aggressive handheld motion: rates up to 3.5 rad/s, accelerations up to 9 m/s^2.
MotionProfile HardMotion();

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

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What is wrong with a real IMU beyond white noise and walking biases: vibration of the body it is
// bolted to, biases that settle as it warms up, scale and axes that are not quite right.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// Shaking by engines, wheels, a rotating LiDAR: a few modes of the structure, each rung at random
// (a narrow band, 1 / (pi * kVibrationDecay) = 1.3 Hz wide) at a frequency drawn within
// [lowest, highest]. What lies above half the rate of the IMU is folded down by the sampling. It
// moves nothing else: 0.3 m/s^2 at 50 Hz are 3 um, 0.03 rad/s 0.005 deg, far below what LiDAR and
// cameras can see.
struct ImuVibration {
  double acceleration = 0.0;  // m/s^2, rms per axis of all modes
  double rate = 0.0;          // rad/s, likewise
  double lowest = 20.0;       // Hz
  double highest = 120.0;     // Hz
};

inline constexpr int kVibrationModes = 4;
inline constexpr double kVibrationDecay = 0.25;  // s, in which a mode rings down to 1 / e

// Biases that settle as the sensor warms up: what they move by in the end, in directions of their
// own, 1 - exp(-t / time_constant) of it after t.
struct ImuWarmUp {
  double accelerometer = 0.0;   // m/s^2
  double gyroscope = 0.0;       // rad/s
  double time_constant = 60.0;  // s
};

// Largest error of the elements of the matrix M = I + E by which a sensor multiplies what it
// measures: scale on the diagonal, axes that are not square or not those of the case beside it.
struct ImuSensitivity {
  double accelerometer = 0.0;  // 0.005 is half a per cent
  double gyroscope = 0.0;
};

struct ImuErrors {
  ImuVibration vibration = {};
  ImuWarmUp warm_up = {};
  ImuSensitivity sensitivity = {};
};

// Whether anything is wrong.
bool HasErrors(const ImuErrors& errors);

// Acceleration (head, m/s^2) and rate (tail, rad/s) of the vibration at instants k / rate_hz, k =
// 0 .. count - 1; empty if there is none. Exactly Gaussian and stationary: the mode's complex
// amplitude is an Ornstein-Uhlenbeck process, whose steps have a closed form at any rate.
std::vector<Vector6d> MakeVibration(const ImuVibration& vibration, double rate_hz,
                                    std::size_t count, RandomStream random);

// I + E with elements of E uniform within +-`limit`.
Eigen::Matrix3d DrawSensitivity(double limit, RandomStream& random);

}  // namespace mlvi

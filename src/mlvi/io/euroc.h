// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The CSV files of EuRoC-style datasets: stamps in integer nanoseconds, quaternions w first.
#pragma once

#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// Ground truth: t, p (3), q wxyz (4), and when there v (3), b_gyroscope (3), b_accelerometer (3);
// the pose of the IMU in the world, velocities in the world. Errors (kInput) give file and line.
Expected<std::vector<NavState>> ReadEurocGroundTruth(const std::string& path);
// IMU data: t, angular velocity (3, rad/s), acceleration (3, m/s^2).
Expected<std::vector<ImuSample>> ReadEurocImu(const std::string& path);

}  // namespace mlvi

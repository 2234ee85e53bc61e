// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "mlvi/sim/faults.h"

namespace mlvi {

// The faults of `mlvi simulate` as typed; numbers still to be given a meaning.
struct FaultArguments {
  // Pairs of seconds: start and length (time_jump: start and jump).
  std::vector<double> lidar_gap, imu_gap, empty_sweeps, nan_points, corrupted_sweeps, nan_imu,
      corrupted_imu, image_gap, lights_off, time_jump;
  std::vector<double> imu_saturation, imu_vibration;  // m/s^2, rad/s
  std::vector<double> imu_warm_up;                    // likewise, and s
  std::vector<double> imu_scale;                      // shares, of accelerometer and gyroscope
  std::vector<double> exposure_jump;                  // start, length, factor
  std::vector<double> extrinsics_error;               // deg, m
  std::vector<std::string> clocks, dead_cameras, frozen_cameras, corrupted_cameras, lens_patches,
      triggers;
  bool imu_in_g = false;
};

void AddFaultOptions(CLI::App& command, FaultArguments& arguments);
// Errors (kConfiguration) name the option and what it takes.
Expected<SequenceFaults> FaultsOf(const FaultArguments& arguments);
nlohmann::ordered_json ToJson(const Clocks& clocks);
nlohmann::ordered_json ToJson(const SequenceFaults& faults);

}  // namespace mlvi

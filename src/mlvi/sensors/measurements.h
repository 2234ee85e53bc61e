// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What the sensors deliver, already in SI units and on the clock of the recording.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "mlvi/base/time.h"

namespace mlvi {

struct ImuSample {
  Time stamp;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  // rad/s, body frame
  // Specific force, m/s^2, body frame.
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();
  // Between the measured neighbours of an interpolated sample; zero for a measured one.
  Duration interpolated_over;
};

// One return of a LiDAR, in the lidar frame at the instant of its own firing.
struct LidarPoint {
  // Metres; all zero stands for "no return" (only towards io writers).
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float intensity = 0.0F;
  std::int32_t offset_ns = 0;  // firing time after LidarSweep::stamp, >= 0
  std::uint16_t ring = 0;      // laser index, as the sensor numbers them
};

// One sweep (one turn of a spinning LiDAR). Read from a file it holds finite, non-zero points only,
// with the first firing at offset 0.
struct LidarSweep {
  Time stamp;  // instant of the first firing
  std::vector<LidarPoint> points;
  Duration span;  // largest offset; zero when all points are valid at `stamp`
  // Offsets are measured or derived; false: the sweep is taken as instantaneous.
  bool has_times = false;
  bool has_rings = false;
  bool has_intensity = false;

  Time end() const { return stamp + span; }
};

// One camera image, 8 bit per channel; grey wherever it is processed.
struct Image {
  Time stamp;  // middle of the exposure, camera clock corrected by the rig's time offset
  int camera = 0;
  int width = 0;
  int height = 0;
  int channels = 1;                  // 3: blue, green, red (only towards io writers)
  std::vector<std::uint8_t> pixels;  // row-major, width * height * channels
};

// What the cameras saw at (nearly) the same time: at most one image per camera, in the order of the
// cameras' indices. Cameras that delivered nothing are absent. Each image keeps its own stamp;
// `stamp` is the latest of them, so that an IMU that covers the set covers every image.
struct ImageSet {
  Time stamp;
  std::vector<Image> images;
};

using Measurement = std::variant<ImuSample, LidarSweep, Image>;

// The instant from which on the measurement could have been known: the last firing of a sweep, the
// stamp of others.
inline Time AvailableAt(const Measurement& measurement) {
  if (const auto* sweep = std::get_if<LidarSweep>(&measurement)) return sweep->end();
  if (const auto* imu = std::get_if<ImuSample>(&measurement)) return imu->stamp;
  return std::get<Image>(measurement).stamp;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A calibration in Kalibr's files, for tests.
#pragma once

namespace mlvi::test {

// cam0 looks along the IMU's x axis from (0.07, 0.05, -0.02) m: its x axis is the IMU's -y, its y
// axis the IMU's -z. cam1 is 0.11 m along the x axis of cam0, turned by nothing. The clock of cam0
// is 1.8 ms late (t_imu = t_cam + shift).
inline constexpr char kCamchain[] = R"(
cam0:
  T_cam_imu:
  - [0, -1, 0, 0.05]
  - [0, 0, -1, -0.02]
  - [1, 0, 0, -0.07]
  - [0, 0, 0, 1]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.04, -0.01, 0.005, -0.001]
  distortion_model: equidistant
  intrinsics: [350, 351, 360, 270]
  resolution: [720, 540]
  rostopic: /stereo/left
  timeshift_cam_imu: -0.0018
cam1:
  T_cn_cnm1:
  - [1, 0, 0, -0.11]
  - [0, 1, 0, 0]
  - [0, 0, 1, 0]
  - [0, 0, 0, 1]
  cam_overlaps: [0]
  camera_model: omni
  distortion_coeffs: [-0.04, 0.15, 0.0002, -0.0012]
  distortion_model: radtan
  intrinsics: [1.99, 670, 669, 378, 280]
  resolution: [720, 540]
  rostopic: /stereo/right
  timeshift_cam_imu: 0.0
)";

inline constexpr char kKalibrImu[] = R"(
accelerometer_noise_density: 0.019
accelerometer_random_walk: 0.0043
gyroscope_noise_density: 0.002
gyroscope_random_walk: 0.000266
rostopic: /imu0
update_rate: 400.0
)";

}  // namespace mlvi::test

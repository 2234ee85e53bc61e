// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A sensor rig as one validated value. The body frame is the IMU; every other sensor is placed in
// it by one transform.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

class CameraModel;
struct Image;

// Continuous-time noise of an IMU (Kalibr's convention).
struct ImuNoise {
  double accelerometer_density = 0.0;      // m/s^2/sqrt(Hz)
  double gyroscope_density = 0.0;          // rad/s/sqrt(Hz)
  double accelerometer_random_walk = 0.0;  // m/s^3/sqrt(Hz)
  double gyroscope_random_walk = 0.0;      // rad/s^2/sqrt(Hz)
};

enum class AccelerationUnit : int { kAuto = 0, kMetresPerSecondSquared = 1, kGravities = 2 };

struct ImuSpec {
  std::string topic;
  double rate_hz = 0.0;
  ImuNoise noise;
  double initial_accelerometer_bias_sigma = 0.1;  // m/s^2, one sigma per axis
  double initial_gyroscope_bias_sigma = 0.01;     // rad/s
  double accelerometer_saturation = 150.0;        // m/s^2
  double gyroscope_saturation = 30.0;             // rad/s
  AccelerationUnit acceleration_unit = AccelerationUnit::kAuto;
  Duration time_offset;  // added to message stamps to come to the rig's clock
};

// How the points of a sweep are timed.
enum class PointTiming : int {
  kAuto = 0,          // per-point times if the message has them, else derived from azimuth
  kInstantaneous = 1  // already motion-compensated: all points are valid at the message stamp
};

struct LidarSpec {
  std::string topic;
  std::string model;  // e.g. "OS0-128": pattern of the simulator, and message layout written by it
  Pose3 T_body_lidar;
  int rings = 0;               // number of lasers, 0 when unknown
  double rate_hz = 10.0;       // sweeps per second
  double min_range = 0.5;      // m; nearer points (operator, own body) are dropped
  double max_range = 100.0;    // m
  double range_noise = 0.02;   // m, one sigma
  double beam_noise = 0.0009;  // rad, one sigma of the beam direction
  PointTiming point_timing = PointTiming::kAuto;
  Duration time_offset;
};

struct CameraSpec {
  std::string name;  // "cam0"
  std::string topic;
  std::shared_ptr<const CameraModel> model;
  Pose3 T_body_camera;
  double rate_hz = 0.0;
  Duration time_offset;  // t_imu = t_cam + offset (Kalibr's timeshift_cam_imu)
  // Features beyond this distance from the principal point are not used; 0: no limit.
  double valid_radius_px = 0.0;
  std::string mask_file;  // where `mask` came from; empty: nowhere
  // Of the size of the camera's images, zero = do not use; null: use all.
  std::shared_ptr<const Image> mask;
};

struct Rig {
  std::string name;
  double gravity = 9.81;  // m/s^2, magnitude
  ImuSpec imu;
  std::optional<LidarSpec> lidar;
  std::vector<CameraSpec> cameras;
  std::optional<Eigen::Vector3d>
      p_body_pano;           // centre S of the panoramic sphere; default: mean camera centre
  Pose3 T_body_groundtruth;  // the frame that the dataset's ground truth describes

  // In the order of `cameras`.
  std::vector<std::string> CameraNames() const;

  // Checks ranges and relations of all values; the Error names field, value and constraint.
  Expected<void> Validate() const;
};

// A 3x3 matrix read from a file as a rotation, or what is wrong with it: det -1, not orthonormal,
// not finite. `field` names it in the message. Small rounding (1e-3) is repaired by projection to
// SO(3).
Expected<Eigen::Quaterniond> RotationFromMatrix(const Eigen::Matrix3d& matrix,
                                                const std::string& field);

}  // namespace mlvi

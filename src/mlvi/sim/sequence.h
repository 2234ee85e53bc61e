// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What can be simulated: named sequences (a world, a walk, a way of moving), the rig with its
// physical noise, faults.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/camera_sensor.h"
#include "mlvi/sim/motion.h"
#include "mlvi/sim/places.h"

namespace mlvi {

// Seconds after the beginning of the recording.
struct FaultWindow {
  double start = 0.0;
  double length = 0.0;

  bool Contains(double seconds) const { return seconds >= start && seconds < start + length; }
};

struct TimeJump {
  double start = 0.0;  // s after the beginning, on the true clock
  double back = 0.0;   // s by which all stamps from then on are too early
};

struct SequenceFaults {
  std::optional<FaultWindow> lidar_gap;     // sweeps that start inside are missing
  std::optional<FaultWindow> imu_gap;       // samples inside are missing
  std::optional<FaultWindow> empty_sweeps;  // sweeps that start inside have no return
  std::optional<FaultWindow>
      nan_points;  // a tenth of the points of sweeps that start inside are NaN
  std::optional<TimeJump> time_jump;
  bool imu_in_g = false;  // the driver reports accelerations in multiples of 9.80665 m/s^2
};

// The rig as it is, and as the estimator is told.
struct SimulatedRig {
  Rig true_rig;
  Rig estimator_rig;
};

// The ground truth of simulated recordings describes the body itself. With `wrong_extrinsics` the
// true T_body_lidar differs from `rig`'s: for hilti_2022 it is the value calibrated in 2023 (0.40
// deg and 8 mm away), for other rigs it is turned by 0.4 deg and moved by 8 mm, in directions drawn
// by `seed`.
SimulatedRig MakeSimulatedRig(const Rig& rig, bool wrong_extrinsics, std::uint64_t seed);

// The IMU's own noise, by rig name (newer_college, m2dgr, hilti_2022; see RIGS 1.5, 2.4, 4.5); for
// other rigs the noise of the rig file. Rig files hold what suits an estimator, which is larger.
ImuNoise PhysicalImuNoise(const Rig& rig);

// Image sensors by rig name: colour and longer exposures for m2dgr, else those of the Alphasense.
CameraPhysics PhysicalCamera(const Rig& rig);

struct SequenceOptions {
  std::string sequence = "courtyard-easy";
  SimulatedRig rig;
  ImuNoise imu_noise;
  double seconds = 0.0;  // 0: the sequence's own length
  std::uint64_t seed = 1;
  // Seconds at rest at the beginning; 0 starts in motion.
  double rest = 2.0;
  Time begin = Time::FromNanoseconds(1'700'000'000'000'000'000);
  // Recorded motion of the body instead of the sequence's walk (`rest` does not apply). Its first
  // pose is moved to the start of the walk, by a shift and a turn about the vertical; its stamps to
  // `begin`.
  std::optional<PoseSpline> trajectory = {};
  SequenceFaults faults = {};
  // Names of the rig's cameras that take images; without any, nothing is drawn for them.
  std::vector<std::string> cameras = {};
  double image_rate = 0.0;  // Hz, of all cameras; 0: each one's own
  CameraPhysics camera_physics = {};
};

// The usual options for a rig: physical noise, no faults, no images.
SequenceOptions StandardSequence(const std::string& sequence, const Rig& rig, double seconds = 0.0,
                                 std::uint64_t seed = 1);

struct SequenceInfo {
  std::string name;
  std::string description;
  double seconds = 0.0;  // default length
  Place (*make_place)(std::uint64_t seed) = nullptr;
  MotionProfile (*make_profile)() = nullptr;
  std::string rig = "newer_college";  // the rig that recorded it; any other one will do
  std::string paper = {};             // the sequence of the paper's tables that it stands for
};

const std::vector<SequenceInfo>& SequenceCatalogue();
// nullptr when there is none of that name.
const SequenceInfo* FindSequence(const std::string& name);

// What is wrong with the options, if anything: an unknown sequence or camera (with the nearest
// name), a rig without LiDAR or with one that cannot be simulated, a length without one sweep.
Expected<void> CheckOptions(const SequenceOptions& options);

}  // namespace mlvi

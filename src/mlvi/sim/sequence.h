// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What can be simulated: named sequences (a world, a walk, a way of moving), the rig with its
// physical noise, faults.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/camera_sensor.h"
#include "mlvi/sim/faults.h"
#include "mlvi/sim/imu_simulator.h"
#include "mlvi/sim/motion.h"
#include "mlvi/sim/places.h"

namespace mlvi {

// The rig as it is, and as the estimator is told. The files of real rigs hold IMU noise far above
// the physical one, to cover vibration and scale errors. Where the simulated IMU has these, the
// estimator is told what the file says, and no less than noise and vibration together (Recording
// does that), else the noise of the file up to twice the noise simulated. Files of other rigs hold
// what is simulated, and the estimator is told just that.
struct SimulatedRig {
  Rig true_rig;
  Rig estimator_rig;
};

// The ground truth of simulated recordings describes the body itself. With `wrong_extrinsics` the
// true T_body_lidar differs from `rig`'s: for hilti_2022 it is the value calibrated in 2023 (0.40
// deg and 8 mm away), for other rigs it is turned by 0.4 deg and moved by 8 mm, in directions drawn
// by `seed`.
SimulatedRig MakeSimulatedRig(const Rig& rig, bool wrong_extrinsics, std::uint64_t seed);

// The true mounts of LiDAR and cameras differ from `rig`'s by `error`.
SimulatedRig MakeSimulatedRig(const Rig& rig, const ExtrinsicsError& error, std::uint64_t seed);

// The IMU's own noise, by rig name (newer_college, m2dgr, hilti_2022; see RIGS 1.5, 2.4, 4.5); for
// other rigs the noise of the rig file. Rig files hold what suits an estimator, which is larger.
ImuNoise PhysicalImuNoise(const Rig& rig);

// Image sensors by rig name: colour and longer exposures for m2dgr, else those of the Alphasense.
CameraPhysics PhysicalCamera(const Rig& rig);

// A world from elsewhere (scene_import.h), and the walk through it: at least 3 waypoints of the
// body, or none where a recorded trajectory, already in the frame of the mesh, moves it.
struct OwnWorld {
  TriangleMesh mesh;
  Lighting lighting = {};
  std::vector<Eigen::Vector3d> waypoints = {};
  double rounding = 0.4;  // m (WalkingPath)
};

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
  // Where the recorded motion starts instead (position of the body and heading).
  std::optional<PathPoint> trajectory_start = {};
  // IMU samples recorded with `trajectory`, on its clock, instead of simulated ones: real
  // vibration, biases and noise. Ground truth is then as good as the trajectory.
  RecordedImu recorded_imu = {};
  // A world of one's own instead of the sequence's place.
  std::shared_ptr<const OwnWorld> own_world = {};
  // A LiDAR of a straight line, the first surface, white noise (IdealPhysics).
  bool ideal_lidar = false;
  bool plane_surfaces = false;  // LidarPhysics
  // A person behind the rig carries it on the sequence's walk (places/operator.h), behind the
  // rearmost of its sensors; not along recorded motion or through an own world, and not what cannot
  // be carried.
  bool carried = false;
  // As far as `faults` say nothing else:
  ImuErrors imu_errors = {};
  Clocks clocks = {};
  SequenceFaults faults = {};
  // The sensor on whose clock the truth is that comes with such recordings; empty: a clock without
  // errors. Newer College's and Hilti's truth is registered sweeps, so it is the LiDAR's; that of
  // M2DGR comes from instruments of their own.
  std::string truth_clock = {};
  // Names of the rig's cameras that take images; without any, nothing is drawn for them.
  std::vector<std::string> cameras = {};
  double image_rate = 0.0;  // Hz, of all cameras; 0: each one's own
  CameraPhysics camera_physics = {};

  // s: `seconds`, or the sequence's own, and no more than a recorded trajectory has.
  double length() const;
};

// Whether a person can carry it before them: all sensors are near enough to the body.
bool CanBeCarried(const Rig& rig);

// The usual options for a rig: physical noise, calibrated as well as the sequence's real rig, no
// faults, no images; LiDAR as imperfect as the sequence says, and so is the IMU of a rig that such
// sequences were recorded with (the BMI085 of newer_college and hilti_2022).
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
  // How well the real rig was calibrated: how far true mounts are from the rig file's.
  ExtrinsicsError calibration = {};
  bool ideal_lidar = false;  // SequenceOptions
};

const std::vector<SequenceInfo>& SequenceCatalogue();
// nullptr when there is none of that name.
const SequenceInfo* FindSequence(const std::string& name);

// What is wrong with the options, if anything: an unknown sequence or camera (with the nearest
// name), a rig without LiDAR or with one that cannot be simulated, a length without one sweep.
Expected<void> CheckOptions(const SequenceOptions& options);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/sequence.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/random.h"
#include "mlvi/base/suggestion.h"
#include "mlvi/sim/lidar_pattern.h"
#include "mlvi/sim/random_direction.h"

namespace mlvi {
namespace {

Place MakeRoom01(std::uint64_t seed) { return MakeRoom(seed, 1); }
Place MakeRoom02(std::uint64_t seed) { return MakeRoom(seed, 2); }
Place MakeRoom03(std::uint64_t seed) { return MakeRoom(seed, 3); }

// M2DGR's mounts are design values, "of the order of 1 deg" off (RIGS 2.3).
constexpr ExtrinsicsError kDesignValues{.rotation = 0.7 * std::numbers::pi / 180.0,
                                        .translation = 0.02};

// The project's own places keep the LiDAR that recorded figures were measured with.
constexpr bool kIdealLidar = true;

// The BMI085 of the handheld rigs, bolted to a LiDAR that turns. Vibration: filters need noise of
// 0.019 m/s^2/sqrt(Hz) and 0.002 rad/s/sqrt(Hz) on the real recordings, ten times its own (RIGS
// 1.5), which is as much as that at 200 Hz. Scale and axes: of the order of the tolerances of such
// sensors, 0.5 % and 1 %. Warm-up: 10 K at 0.2 mg/K and 0.015 deg/s/K. Tolerances and temperature
// coefficients are those of its family's data sheets from memory.
constexpr ImuErrors kHandheldImu{
    .vibration = {.acceleration = 0.27, .rate = 0.028},
    .warm_up = {.accelerometer = 0.02, .gyroscope = 2.6e-3, .time_constant = 60.0},
    .sensitivity = {.accelerometer = 0.005, .gyroscope = 0.01}};

// T_body_lidar of the Hilti handheld as calibrated in 2023 (RIGS 3.3).
Pose3 Hilti2023Extrinsics() {
  const Eigen::Matrix3d R =
      (Eigen::Matrix3d() << 0.006609639848469365, -0.9999773650294649, 0.0012578115132016717,
       -0.9999762249571927, -0.006612093869054189, -0.0019569708811106104, 0.001965243352927244,
       -0.0012448467359610184, -0.9999972940839232)
          .finished();
  return Pose3(Eigen::Quaterniond(R),
               {-0.006730146149038548, -0.006897049862999071, 0.049898628062256645});
}

// What a careful user writes into the rig file of an IMU with the noise `physical`: twice that, but
// no more than stands in the file of the real rig.
ImuNoise WithMargin(const ImuNoise& physical, const ImuNoise& file) {
  const auto margin = [](double a, double b) { return std::min(2.0 * a, std::max(a, b)); };
  return {margin(physical.accelerometer_density, file.accelerometer_density),
          margin(physical.gyroscope_density, file.gyroscope_density),
          margin(physical.accelerometer_random_walk, file.accelerometer_random_walk),
          margin(physical.gyroscope_random_walk, file.gyroscope_random_walk)};
}

}  // namespace

SimulatedRig MakeSimulatedRig(const Rig& rig, bool wrong_extrinsics, std::uint64_t seed) {
  SimulatedRig result{.true_rig = rig, .estimator_rig = rig};
  result.true_rig.T_body_groundtruth = result.estimator_rig.T_body_groundtruth = Pose3();
  result.estimator_rig.imu.noise = WithMargin(PhysicalImuNoise(rig), rig.imu.noise);
  if (!wrong_extrinsics || !rig.lidar) return result;
  Pose3& truth = result.true_rig.lidar->T_body_lidar;
  if (rig.name == "hilti_2022") {
    truth = Hilti2023Extrinsics();
    return result;
  }
  RandomStream random(seed, "extrinsics");
  const Eigen::Vector3d turn = 0.4 * std::numbers::pi / 180.0 * RandomDirection(random);
  const Eigen::Vector3d shift = 0.008 * RandomDirection(random);
  truth = Pose3(truth.rotation() * ExpSo3(turn), truth.translation() + shift);
  return result;
}

SimulatedRig MakeSimulatedRig(const Rig& rig, const ExtrinsicsError& error, std::uint64_t seed) {
  SimulatedRig result = MakeSimulatedRig(rig, false, seed);
  DisturbExtrinsics(error, RandomStream(seed, "extrinsics error"), result.true_rig);
  return result;
}

ImuNoise PhysicalImuNoise(const Rig& rig) {
  if (rig.name == "newer_college") return {1.1e-3, 2.3e-4, 3.4e-5, 8.3e-6};
  if (rig.name == "m2dgr") {
    return {3.7686306102624571e-02, 2.3417543020438883e-03, 1.1416642385952368e-03,
            1.4428407712885209e-05};
  }
  if (rig.name == "hilti_2022") return {1.32435e-3, 1.9e-4, 3.4e-5, 8e-6};
  return rig.imu.noise;
}

CameraPhysics PhysicalCamera(const Rig& rig) {
  CameraPhysics physics;
  if (rig.name == "m2dgr") {
    physics.colour = true;
    physics.max_exposure = 15e-3;
  }
  return physics;
}

namespace {

// The rig as the sequence's was: the Hilti handheld with its calibration of 2022 (truth: 2023),
// others with random errors.
SimulatedRig CalibratedRig(const std::string& sequence, const Rig& rig, std::uint64_t seed) {
  const SequenceInfo* info = FindSequence(sequence);
  if (info != nullptr && info->rig == rig.name && info->rig == "hilti_2022")
    return MakeSimulatedRig(rig, true, seed);
  if (info != nullptr && info->calibration.rotation > 0.0)
    return MakeSimulatedRig(rig, info->calibration, seed);
  return MakeSimulatedRig(rig, false, seed);
}

// The BMI085 on a LiDAR that turns, in hands.
bool IsHandheld(const Rig& rig) { return rig.name == "newer_college" || rig.name == "hilti_2022"; }

// Calm walks, robots and the project's own places keep an IMU with nothing but noise, and so do
// rigs whose IMU is another one: their files say what it is like.
ImuErrors ErrorsOf(const SequenceInfo& info, const Rig& rig) {
  const std::vector<MotionProfile (*)()> shaken = {&MediumMotion, &HardMotion, &StairsMotion,
                                                   &SurveyMotion, &HastySurveyMotion};
  const bool hard = std::ranges::find(shaken, info.make_profile) != shaken.end();
  return hard && !info.ideal_lidar && IsHandheld(rig) ? kHandheldImu : ImuErrors{};
}

// Alphasense and LiDAR share a clock (PTP), images are stamped in the middle of their exposure; what
// is left between them and the IMU are the 1.7 to 1.8 ms of the cameras' calibrations (RIGS 1.2,
// 3.2), presumably its filters' delay. Rig files know it of the cameras but not of the LiDAR: its
// stamps are early by as much on the IMU's clock.
Clocks SharedClock(const Rig& rig) {
  if (rig.cameras.empty()) return {};
  double sum = 0.0;
  for (const CameraSpec& camera : rig.cameras) sum += camera.time_offset.seconds();
  return {{"lidar", {.offset = -sum / static_cast<double>(rig.cameras.size())}}};
}

// Stamps as the real rigs' drivers make them. On M2DGR's robot a computer stamps what arrives
// (nothing is published, RIGS 2.4): the IMU through a serial port (30 bytes and a poll), packets of
// 0.7 ms, images through USB; amounts are assumed.
Clocks ClocksOf(const Rig& rig) {
  if (IsHandheld(rig)) return SharedClock(rig);
  if (rig.name != "m2dgr") return {};
  Clocks clocks = {{"imu", {.offset = 4e-3, .jitter = 2e-3}},
                   {"lidar", {.offset = 1e-3, .jitter = 0.5e-3}}};
  for (const CameraSpec& camera : rig.cameras)
    clocks[camera.name] = {.offset = 5e-3, .jitter = 1e-3};
  return clocks;
}

}  // namespace

double SequenceOptions::length() const {
  const double asked = seconds == 0.0 ? FindSequence(sequence)->seconds : seconds;
  return trajectory ? std::min(asked, (trajectory->end() - trajectory->begin()).seconds()) : asked;
}

bool CanBeCarried(const Rig& rig) {
  constexpr double kArmsLength = 0.6;  // m
  double farthest = rig.lidar ? rig.lidar->T_body_lidar.translation().norm() : 0.0;
  for (const CameraSpec& camera : rig.cameras)
    farthest = std::max(farthest, camera.T_body_camera.translation().norm());
  return farthest <= kArmsLength;
}

SequenceOptions StandardSequence(const std::string& sequence, const Rig& rig, double seconds,
                                 std::uint64_t seed) {
  const SequenceInfo* info = FindSequence(sequence);
  return {.sequence = sequence,
          .rig = CalibratedRig(sequence, rig, seed),
          .imu_noise = PhysicalImuNoise(rig),
          .seconds = seconds,
          .seed = seed,
          .ideal_lidar = info != nullptr && info->ideal_lidar,
          .carried = info != nullptr && info->make_profile().gait > 0.0 && !info->ideal_lidar,
          .imu_errors = info != nullptr ? ErrorsOf(*info, rig) : ImuErrors{},
          .clocks = info != nullptr && !info->ideal_lidar ? ClocksOf(rig) : Clocks{},
          .truth_clock = IsHandheld(rig) ? "lidar" : "",
          .camera_physics = PhysicalCamera(rig)};
}

const std::vector<SequenceInfo>& SequenceCatalogue() {
  static const std::vector<SequenceInfo> catalogue = {
      {"courtyard-easy",
       "a calm round in a quadrangle of 40 x 40 m",
       80.0,
       &MakeCourtyard,
       &EasyMotion,
       "newer_college",
       "",
       {},
       kIdealLidar},
      {"courtyard-hard",
       "the same round, the sensor waved about at up to 3.5 rad/s",
       80.0,
       &MakeCourtyard,
       &HardMotion,
       "newer_college",
       "",
       {},
       kIdealLidar},
      {"corridor-easy",
       "a calm walk: lobby, featureless corridor, stairs up, room",
       120.0,
       &MakeCorridor,
       &EasyMotion,
       "newer_college",
       "",
       {},
       kIdealLidar},
      {"corridor-hard",
       "the same walk, the sensor waved about at up to 3.5 rad/s",
       120.0,
       &MakeCorridor,
       &HardMotion,
       "newer_college",
       "",
       {},
       kIdealLidar},
      // Newer College
      {"quad-easy", "an old quadrangle, once round and partly back, calm", 110.0, &MakeQuad,
       &EasyMotion, "newer_college", "Quad-Easy"},
      {"quad-medium", "the same, brisk", 110.0, &MakeQuad, &MediumMotion, "newer_college"},
      {"quad-hard", "the same, the sensor waved about at up to 3.5 rad/s", 110.0, &MakeQuad,
       &HardMotion, "newer_college", "Quad-Hard"},
      {"math-easy", "plaza, arcade, passage and court of an institute, calm", 120.0,
       &MakeMathInstitute, &EasyMotion, "newer_college", "Math-Easy"},
      {"math-medium", "the same, brisk", 110.0, &MakeMathInstitute, &MediumMotion, "newer_college",
       "Math-Medium"},
      {"math-hard", "the same, the sensor waved about", 110.0, &MakeMathInstitute, &HardMotion,
       "newer_college", "Math-Hard"},
      {"undermine-hard", "rough galleries of a mine in the dark, the sensor waved about", 110.0,
       &MakeMine, &HardMotion, "newer_college", "Undermine-Hard"},
      {"stairs", "five storeys up a narrow bare stairwell and partly down again", 120.0,
       &MakeStairwell, &StairsMotion, "newer_college", "Stairs"},
      {"cloister", "round a cloister, arcade on one side, bare wall on the other", 110.0,
       &MakeCloister, &EasyMotion, "newer_college", "Cloister"},
      // M2DGR
      {"room-01", "laboratory, robot, one person walking", 72.0, &MakeRoom01, &SlowRobotMotion,
       "m2dgr", "room-01", kDesignValues},
      {"room-02", "laboratory, robot, two people walking", 75.0, &MakeRoom02, &SlowRobotMotion,
       "m2dgr", "room-02", kDesignValues},
      {"room-03", "laboratory, robot, three people walking", 100.0, &MakeRoom03, &SlowRobotMotion,
       "m2dgr", "room-03", kDesignValues},
      {"hall-05", "large hall with walls of glass, robot, visitors", 120.0, &MakeHall, &RobotMotion,
       "m2dgr", "hall-05", kDesignValues},
      {"door-02", "robot from a corridor through a foyer into the open and back", 120.0, &MakeDoor,
       &RobotMotion, "m2dgr", "door-02", kDesignValues},
      {"gate-03", "robot through a campus gate, pedestrians and cars", 120.0, &MakeGate,
       &RobotMotion, "m2dgr", "gate-03", kDesignValues},
      {"walk-01", "robot along a street with parked and moving cars and pedestrians", 120.0,
       &MakeStreet, &RobotMotion, "m2dgr", "walk-01", kDesignValues},
      // Hilti 2022
      {"construction-upper-level-3", "concrete frame in the raw, hasty handheld survey", 100.0,
       &MakeConstruction, &HastySurveyMotion, "hilti_2022", "Construction Upper Level 3"},
      {"basement-2", "narrow dim passages, plant room, store, handheld survey", 110.0,
       &MakeBasement, &SurveyMotion, "hilti_2022", "Basement 2"},
      {"attic-to-upper-gallery-2", "attic, narrow stairs, gallery of a theatre, handheld survey",
       120.0, &MakeAttic, &SurveyMotion, "hilti_2022", "Attic to Upper Gallery 2"},
      {"corridor-lower-gallery-2", "bare corridor, gallery of a theatre, handheld survey", 120.0,
       &MakeLowerGallery, &SurveyMotion, "hilti_2022", "Corridor Lower Gallery 2"},
  };
  return catalogue;
}

const SequenceInfo* FindSequence(const std::string& name) {
  const auto& all = SequenceCatalogue();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const SequenceInfo& s) { return s.name == name; });
  return found == all.end() ? nullptr : &*found;
}

namespace {

Expected<void> CheckCameras(const SequenceOptions& options) {
  constexpr ErrorKind kKind = ErrorKind::kConfiguration;
  std::vector<std::string> names;
  for (const CameraSpec& spec : options.rig.true_rig.cameras) names.push_back(spec.name);
  for (const std::string& camera : options.cameras) {
    const auto found = std::ranges::find(names, camera);
    if (found == names.end()) {
      return MakeError(kKind, "rig '{}' has no camera '{}'; it has: {}", options.rig.true_rig.name,
                       camera, names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
    }
    const double rate =
        options.rig.true_rig.cameras[static_cast<std::size_t>(found - names.begin())].rate_hz;
    const double asked = options.image_rate == 0.0 ? rate : options.image_rate;
    if (!(asked > 0.0 && asked <= 200.0)) {
      return MakeError(kKind,
                       "camera '{}': an image rate of {} Hz; it must be positive and at most 200",
                       camera, asked);
    }
  }
  return {};
}

bool IsPlace(const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff() <= 1e4 && p.allFinite(); }

// Where the body is to move.
Expected<void> CheckMotion(const SequenceOptions& options) {
  constexpr ErrorKind kKind = ErrorKind::kConfiguration;
  if (!(options.rest >= 0.0 && options.rest <= 86400.0))
    return MakeError(kKind, "a rest of {} s; it must be 0 to 86400", options.rest);
  if (!options.recorded_imu.samples.empty() && !options.trajectory)
    return MakeError(kKind, "recorded IMU samples without the trajectory that they belong to");
  const SequenceFaults& faults = options.faults;
  if (!options.recorded_imu.samples.empty() &&
      (faults.imu_vibration || faults.imu_warm_up || faults.imu_sensitivity)) {
    return MakeError(
        kKind,
        "recorded IMU samples are played as they are: vibration, warm-up and errors of "
        "scale can be added to simulated ones only");
  }
  if (const auto& start = options.trajectory_start;
      start && !(IsPlace(start->position) && std::isfinite(start->heading))) {
    return MakeError(
        kKind,
        "the trajectory starts at ({}) m with heading {} rad: coordinates must be within 10 km",
        fmt::join(start->position, ", "), start->heading);
  }
  if (!options.own_world) return {};
  for (const Eigen::Vector3d& waypoint : options.own_world->waypoints) {
    if (!IsPlace(waypoint))
      return MakeError(kKind, "a waypoint at ({}) m: coordinates must be within 10 km",
                       fmt::join(waypoint, ", "));
  }
  if (options.own_world->waypoints.size() < 3 && !options.trajectory) {
    return MakeError(kKind,
                     "{} waypoints through the own world; at least 3, or a trajectory, are needed",
                     options.own_world->waypoints.size());
  }
  return {};
}

}  // namespace

Expected<void> CheckOptions(const SequenceOptions& options) {
  constexpr ErrorKind kKind = ErrorKind::kConfiguration;
  if (FindSequence(options.sequence) == nullptr) {
    std::vector<std::string> names;
    for (const SequenceInfo& info : SequenceCatalogue()) names.push_back(info.name);
    return MakeError(kKind, "no sequence is called '{}'{}; there are: {}", options.sequence,
                     DidYouMean(options.sequence, names), fmt::join(names, ", "));
  }
  const Rig& rig = options.rig.true_rig;
  if (!rig.lidar) return MakeError(kKind, "rig '{}' has no LiDAR to simulate", rig.name);
  if (auto pattern = MakeLidarPattern(rig.lidar->model); !pattern)
    return tl::unexpected(pattern.error());
  if (rig.lidar->rate_hz != 10.0) {
    return MakeError(kKind, "lidar.rate_hz is {}; the simulated LiDARs turn 10 times a second",
                     rig.lidar->rate_hz);
  }
  if (rig.imu.rate_hz <= 0.0)
    return MakeError(kKind, "imu.rate_hz is {}, must be positive", rig.imu.rate_hz);
  // Written so that NaN is refused, too.
  if (!(options.seconds == 0.0 || (options.seconds >= 0.1 && options.seconds <= 86400.0))) {
    return MakeError(
        kKind, "a length of {} s; it must be 0.1 (one sweep) to 86400, or 0 for the sequence's own",
        options.seconds);
  }
  if (const auto ok = CheckMotion(options); !ok) return ok;
  if (const auto ok = CheckFaults(options.faults, rig); !ok) return ok;
  const Clocks clocks = EffectiveClocks(options.clocks, options.faults);
  if (const auto ok = CheckClocks(clocks, rig, options.image_rate); !ok) return ok;
  if (const auto ok = CheckTheyHappen(options.faults, options.length(), options.cameras); !ok)
    return ok;
  if (const auto ok = CheckImuErrors(EffectiveErrors(options.imu_errors, options.faults)); !ok)
    return ok;
  return CheckCameras(options);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What goes wrong in a recording, as data, and what each fault does to measurements. Which
// measurement they meet is up to Recording. To add one: a field here, its effect, its option and
// its entry in sequence.json (apps/fault_options.cc).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/sim/imu_errors.h"

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

// A sensor's clock that nobody has calibrated: its stamps are late by offset + drift * t, and by
// what a driver takes until it reads its own clock.
struct ClockError {
  double offset = 0.0;     // s
  double drift_ppm = 0.0;  // microseconds per second
  double jitter = 0.0;     // s; each stamp is later by a part of it, evenly distributed
};

// By "imu", "lidar" or the camera's name.
using Clocks = std::map<std::string, ClockError>;

// Limits of an IMU that is too small for the motion; per axis.
struct ImuSaturation {
  double acceleration = 0.0;  // m/s^2
  double rate = 0.0;          // rad/s
};

// How far the true mounts of LiDAR and cameras are from what the rig file says, in directions drawn
// by the seed.
struct ExtrinsicsError {
  double rotation = 0.0;     // rad
  double translation = 0.0;  // m
};

enum class CameraFailure : int {
  kDead = 0,       // no images
  kFrozen = 1,     // the same image again and again, with new stamps
  kCorrupted = 2,  // messages hold the first half of their image's data
};

struct CameraFault {
  std::string camera;  // name in the rig
  CameraFailure failure = CameraFailure::kDead;
  FaultWindow window;
};

// A smear on a lens: a round patch, blurred (over 0.15 of its radius) and darkened, fading at its
// rim.
struct LensPatch {
  std::string camera;
  double u = 0.5, v = 0.5;  // centre, shares of the image's width and height
  double radius = 0.1;      // share of its width
};

struct ExposureJump {
  FaultWindow window;
  double factor = 4.0;  // of the gain that exposure control chose
};

struct SequenceFaults {
  // LiDAR
  std::optional<FaultWindow> lidar_gap;     // sweeps that start inside are missing
  std::optional<FaultWindow> empty_sweeps;  // sweeps that start inside have no return
  // A tenth of the points of sweeps that start inside is NaN.
  std::optional<FaultWindow> nan_points;
  // Messages of sweeps that start inside are cut off in the middle.
  std::optional<FaultWindow> corrupted_sweeps;
  // IMU
  std::optional<FaultWindow> imu_gap;        // samples inside are missing
  std::optional<FaultWindow> nan_imu;        // samples inside are NaN
  std::optional<FaultWindow> corrupted_imu;  // messages of samples inside are cut off in the middle
  std::optional<ImuSaturation> imu_saturation;
  // Instead of the sequence's own (SequenceOptions::imu_errors).
  std::optional<ImuVibration> imu_vibration;
  std::optional<ImuWarmUp> imu_warm_up;
  std::optional<ImuSensitivity> imu_sensitivity;
  bool imu_in_g = false;  // the driver reports accelerations in multiples of 9.80665 m/s^2
  // Cameras
  std::optional<FaultWindow> image_gap;  // images of all cameras inside are missing
  std::vector<CameraFault> cameras;
  std::vector<LensPatch> lens_patches;
  std::optional<ExposureJump> exposure_jump;
  std::optional<FaultWindow> lights_off;  // all lamps of the place, the carried one among them
  // By the camera's name: it takes its images this much later than the others (s), and stamps them
  // so. Cameras that nobody triggers together.
  std::map<std::string, double> triggers;
  // Clocks and calibration
  std::optional<TimeJump> time_jump;
  Clocks clocks;  // instead of the sequence's own (SequenceOptions::clocks)
  std::optional<ExtrinsicsError> extrinsics;
};

// Accelerations and rates become NaN.
void SpoilSample(ImuSample& sample);

// A tenth of the points, drawn by `random`, becomes NaN.
void SpoilTenth(LidarSweep& sweep, RandomStream random);

// What the clock of `sensor` adds to a stamp `seconds` after the beginning; `random` is that
// stamp's own.
Duration StampError(const Clocks& clocks, const std::string& sensor, double seconds,
                    RandomStream random);

// What it adds there on average over its jitter, s; 0 for a sensor without a clock of its own.
double MeanStampError(const Clocks& clocks, const std::string& sensor, double seconds);

// Inverse: the seconds after the beginning at which that clock shows `shown`, likewise counted, its
// jitter at the mean.
double TrueSeconds(const Clocks& clocks, const std::string& sensor, double shown);

// The failure of `camera` at that time, if any.
std::optional<CameraFailure> FailureOf(const SequenceFaults& faults, const std::string& camera,
                                       double seconds);

// Blurs and darkens what lies behind the patch; grey or colour (`channels` per pixel).
void SmearLens(const LensPatch& patch, int channels, Image& image);

// Turns and shifts the mounts of LiDAR and cameras (T_body_sensor) by that much, in directions
// drawn by `random`.
void DisturbExtrinsics(const ExtrinsicsError& error, RandomStream random, Rig& rig);

// How much later than the others a camera takes its images.
Duration TriggerDelay(const SequenceFaults& faults, const std::string& camera);

// The clocks once those among the faults have taken their places.
Clocks EffectiveClocks(Clocks clocks, const SequenceFaults& faults);

// What is left of an IMU's errors once those among the faults have taken their places.
ImuErrors EffectiveErrors(ImuErrors errors, const SequenceFaults& faults);

// What is wrong with the errors of an IMU, as CheckFaults.
Expected<void> CheckImuErrors(const ImuErrors& errors);

// What is wrong with clocks of that rig, as CheckFaults. Jitter must not be longer than the time that
// the clock shows from one measurement to the next, so that stamps ascend. `image_rate` as
// SequenceOptions has it.
Expected<void> CheckClocks(const Clocks& clocks, const Rig& rig, double image_rate = 0.0);

// What is wrong with the faults for that rig: an unknown camera or sensor, a number that is not
// finite or beyond what can be simulated.
Expected<void> CheckFaults(const SequenceFaults& faults, const Rig& rig);

// Which fault could not be seen in a recording of that length with the images of these cameras, if
// any: one that starts after its end, one of a camera that takes no images.
Expected<void> CheckTheyHappen(const SequenceFaults& faults, double seconds,
                               const std::vector<std::string>& cameras);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Panoramic visual-inertial odometry (VINS-Mono lineage): features of all cameras on one sphere,
// IMU preintegration and, where there is a LiDAR, measured depths, in one sliding window.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/stage_times.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/estimates.h"
#include "mlvi/vio/calibration_deviation.h"
#include "mlvi/vio/vio_config.h"

namespace mlvi {

// What became of one set of images.
struct VioResult {
  enum class Status {
    kInitializing,  // features are tracked, but the motion is not known yet: see `reason`
    kTracking,      // `estimate` holds the new state
    kFailed,        // the estimate is not to be believed since the set that `reason` tells about;
                    // call Start, or wait for a new start
  };
  Status status = Status::kInitializing;
  std::string reason;  // what the start waits for, or why it failed; empty while tracking
  // The state of the body at the stamp of the set, with the window's covariance.
  std::optional<OdometryEstimate> estimate;
  // The motion since the previous estimate, with the window's covariance. What both estimates have
  // in common cancels: it is far more certain than their difference.
  std::optional<MotionPrior> motion;
  TrackingSummary tracking;
  bool keyframe = false;
  // Figures of the window.
  int features = 0;
  int features_with_lidar = 0;
  int iterations = 0;
  double rms_px = 0.0;                // of bearings, per axis
  std::vector<double> camera_rms_px;  // the same by camera: a wrong calibration shows here
  CalibrationDeviation deviation;     // of the calibration from the rig file, as estimated so far
};

// Error (kConfiguration): the rig has no camera, or one that lies outside of the sphere.
Expected<void> CheckRig(const VioConfig& config, const Rig& rig);

// Synchronous and deterministic: the same calls give the same bits at any number of threads.
class Vio {
 public:
  // `times` collects the stages' wall times and must outlive the instance. Contract: a rig that
  // CheckRig accepts.
  Vio(const VioConfig& config, const Rig& rig, StageTimes& times);
  ~Vio();

  // Sets in the order of their stamps. `imu` covers the time from the previous set (or some time
  // before the first one) to set.stamp; samples given before are ignored. Images may be missing.
  VioResult Process(const ImageSet& set, std::span<const ImuSample> imu);

  // A sweep deskewed to the body frame at `stamp`, and where the LiDAR odometry has that body, in a
  // world of its own. Depths are taken from it; T_world_body is never used as a measurement of
  // motion.
  void AddDepthCloud(const PointCloud& points_body, const Pose3& T_world_body, Time stamp);
  // Forgets these sweeps. To be called when the LiDAR odometry has lost track: how its new start is
  // placed to what was before is not known.
  void ClearDepthClouds();

  // Begins, or begins anew, from a state known from outside (LiDAR odometry), valid at any instant
  // within the IMU's memory; takes effect with the next set. Without it the first state comes from
  // cameras and IMU alone (visual_inertial_start.h), in a world of its own; after a failure, in the
  // same world, placed where the trajectory ended.
  void Start(const OdometryEstimate& state);

  // As estimated so far.
  const VioCalibration& calibration() const;
  // The tracks as of the last set, of the frames that are remembered.
  std::span<const Track> tracks() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mlvi

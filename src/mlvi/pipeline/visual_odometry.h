// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/base/stage_times.h"
#include "mlvi/pipeline/camera_fit.h"
#include "mlvi/pipeline/camera_watch.h"
#include "mlvi/pipeline/image_set_builder.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/health.h"
#include "mlvi/vio/vio.h"

namespace mlvi {

struct VisualConfig {
  ImageSetConfig sets;
  CameraWatchConfig watch;
  VioConfig vio;
  void Declare(ConfigDeclaration& d);
};

// What the visual odometry did, for the report.
struct VisualReport {
  std::int64_t sets = 0;
  std::int64_t sets_tracking = 0;
  Time first_estimate;        // invalid: no state was ever found
  std::int64_t failures = 0;  // times that the estimate was given up
  std::string last_failure;   // why; empty when there was none
  std::string waiting_for;    // of the start, as long as there is none
  bool tracking = false;      // at the newest set
};

// The cameras' side of the system: from single images to the visual-inertial estimate, with what is
// known of each camera's health.
class VisualOdometry {
 public:
  // `rig` must have a camera; `times` and `events` must outlive the instance.
  VisualOdometry(const VisualConfig& config, const Rig& rig, StageTimes& times,
                 const EventBus& events);

  // Takes an image and returns the sets that are ready to be processed, in order of time.
  std::vector<ImageSet> Collect(Image image) { return Inspected(sets_.Push(std::move(image))); }
  // Tells how far time has come: sets do not wait for ever, and cameras that are silent are
  // reported.
  std::vector<ImageSet> Advance(Time now);
  // The end of the recording: the sets that are left.
  std::vector<ImageSet> Flush() { return Inspected(sets_.Flush()); }

  // One set through the estimator. `imu` covers the time from the set before to this one.
  VioResult Process(const ImageSet& set, std::span<const ImuSample> imu);
  // What LiDAR odometry found: depth for the features and, where the visual estimate does not run,
  // its start.
  void TakeLidar(const OdometryEstimate& estimate, const PointCloud& points_body);
  // LiDAR odometry has lost track: what it said has no place beside what it will say.
  void LoseLidar() { vio_.ClearDepthClouds(); }

  // Takes over what was dropped before images came here.
  void AddDropped(const DropCounts& dropped);
  // Judges the run. Call once, at its end.
  void Conclude();
  const VisualReport& report() const { return report_; }
  // By the cameras' names; health includes how well a camera fits the others.
  std::map<std::string, StreamReport> Streams() const;
  const CameraFit& fit() const { return fit_; }
  const VioCalibration& calibration() const { return vio_.calibration(); }

 private:
  std::vector<ImageSet> Inspected(std::vector<ImageSet> sets);
  void Observe(const ImageSet& set, const VioResult& result);

  const EventBus& events_;
  ImageSetBuilder sets_;
  CameraWatch watch_;
  CameraFit fit_;
  Vio vio_;
  std::vector<std::string> names_;
  VisualReport report_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mlvi/panorama/panoramic_tracker.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// Sets of images and IMU samples of the last seconds: what predictions and starts are made from.
class FrameHistory {
 public:
  struct Frame {
    FrameId id;
    Time stamp;
    std::optional<Pose3> T_world_body;  // once known
  };

  explicit FrameHistory(Duration memory) : memory_(memory) {}

  // Samples not newer than the last one are ignored.
  void AddSamples(std::span<const ImuSample> samples);
  // Returns the oldest frame that is remembered. Contract: ids and stamps rise.
  FrameId AddFrame(FrameId id, Time stamp);
  void SetPose(FrameId id, const Pose3& T_world_body);
  void ForgetPoses();

  std::span<const ImuSample> samples() const { return samples_; }
  std::span<const Frame> frames() const { return frames_; }
  const Frame* Find(FrameId id) const;  // null when forgotten

  // Motion of the pano frame: by the poses where both are known, else the rotation by the
  // gyroscope.
  PredictedMotion Motion(FrameId earlier, FrameId now, const Pose3& T_body_pano,
                         const Eigen::Vector3d& gyroscope_bias) const;

 private:
  Duration memory_;
  std::vector<ImuSample> samples_;
  std::vector<Frame> frames_;
};

}  // namespace mlvi

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
    std::optional<Pose3> T_world_body = {};  // once known
    // Per camera, or empty where all images are of the stamp: when its image was taken, and where
    // the body was then, in the body at the stamp.
    std::vector<Duration> delays = {};
    std::vector<Pose3> T_body_image = {};
  };

  explicit FrameHistory(Duration memory) : memory_(memory) {}

  // Samples not newer than the last one are ignored.
  void AddSamples(std::span<const ImuSample> samples);
  // Forgets what is older than the memory, but for the frame before and the samples since: pauses
  // between sets are bridged by all the samples there are. Returns the oldest frame that is
  // remembered. Contract: ids and stamps rise.
  FrameId AddFrame(FrameId id, Time stamp, std::vector<Duration> delays = {});
  void SetImagePlaces(FrameId id, std::vector<Pose3> T_body_image);
  void SetPose(FrameId id, const Pose3& T_world_body);
  void ForgetPoses();

  std::span<const ImuSample> samples() const { return samples_; }
  std::span<const Frame> frames() const { return frames_; }
  const Frame* Find(FrameId id) const;  // null when forgotten

  // Motion of the pano frame: by the poses where both are known, else the rotation by the
  // gyroscope.
  PredictedMotion Motion(FrameId earlier, FrameId now, const Pose3& T_body_pano,
                         const Eigen::Vector3d& gyroscope_bias) const;
  // The pano frame at the instant of one camera's image in that at the stamp of its set.
  Pose3 ImagePlace(FrameId id, int camera, const Pose3& T_body_pano) const;

 private:
  Duration memory_;
  std::vector<ImuSample> samples_;
  std::vector<Frame> frames_;
};

}  // namespace mlvi

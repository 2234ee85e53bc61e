// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// First states from cameras and IMU alone, standing or moving.
#pragma once

#include <span>

#include "mlvi/base/config.h"
#include "mlvi/base/error.h"
#include "mlvi/imu/initialization.h"
#include "mlvi/panorama/track_store.h"

namespace mlvi {

struct VisualInertialStartConfig {
  double min_seconds = 1.0;
  double max_seconds = 2.0;
  double frame_interval = 0.09;
  double retry_interval = 0.25;
  int min_tracks = 30;
  double rest_motion = 1.0;
  double max_scale_sigma = 0.2;
  double max_velocity_sigma = 0.1;
  double max_tilt_sigma = 0.02;
  double max_rms = 2.0;
  void Declare(ConfigDeclaration& d);
};

// The instant of a set of images on the IMU's clock.
struct FrameInstant {
  FrameId id;
  Time stamp;
  std::vector<Duration> delays = {};  // per camera, of its image, <= 0; empty: none
};

// What a start is made from. Tracks are read where they were seen in `frames`.
struct StartData {
  std::span<const Track> tracks;
  std::span<const FrameInstant> frames;  // strictly ascending
  std::span<const ImuSample> samples;    // strictly ascending; cover the frames
  Pose3 T_body_pano;
  double pixel_sigma = 1.0;  // px, per axis
  // s, per camera: its images are taken this much later than stamped; empty: none.
  std::span<const double> time_offsets = {};
};

// One state per frame, in the world of imu/initialization.h: gravity-aligned, origin and heading of
// the first body. At rest, which both the IMU and the tracks have to show, by InitializeAtRest;
// otherwise by a closed form for velocity, gravity and depths that is refined with the biases
// (visual_inertial_alignment.h), the views at the instants of their images. The covariance is that of the last state.
// Errors (kEstimation): what is still missing, to be tried again with more data (too short, too few
// tracks, a motion that does not show velocity and gravity yet), or that tracks and IMU contradict
// each other (wrong extrinsics, wrong time offset). The message has the numbers.
Expected<Initialization> InitializeFromTracks(const StartData& data, const ImuSpec& imu,
                                              double gravity,
                                              const VisualInertialStartConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the rig stands still. Bearings and an IMU cannot tell: without parallax depths are free,
// and a slow motion far away from everything explains what is seen as well as rest does, so the
// IMU's errors carry the position off. What makes rest the better explanation is that nothing in
// view moves and the IMU feels nothing but its noise.
#pragma once

#include <span>

#include "mlvi/base/config.h"
#include "mlvi/panorama/track_store.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

struct RestConfig {
  bool enabled = true;
  double seconds = 0.5;
  double max_motion_px = 0.5;
  double min_share = 0.8;
  int min_tracks = 15;
  double max_acceleration = 0.1;
  double max_angular_rate = 0.02;
  double velocity_sigma = 0.02;
  void Declare(ConfigDeclaration& d);
};

// Whether most of the tracks that both frames have are where they were (the rest may be people),
// and the samples between the frames scatter about their mean no more than the noise of the IMU and
// the limits of `config` together explain.
bool IsAtRest(const TrackStore& tracks, FrameId earlier, FrameId now,
              std::span<const ImuSample> between, const ImuSpec& imu, const RestConfig& config);

}  // namespace mlvi

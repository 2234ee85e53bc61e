// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/vio/window.h"

namespace mlvi {

struct KeyframeConfig {
  double min_parallax = 0.02;
  double min_common = 0.6;
  double max_interval = 2.0;
  void Declare(ConfigDeclaration& d);
};

// What the newest frame shows that the newest keyframe did not.
struct FrameNovelty {
  double parallax = 0.0;  // rad, mean angle between bearings of common features without rotation
  double common = 0.0;    // share of the keyframe's features that are seen now
  double interval = 0.0;  // s
};

// Contract: a keyframe before the last frame.
FrameNovelty CompareWithKeyframe(const VioWindow& window);

// Whether the newest frame becomes a keyframe: enough parallax for depths, too few features left in
// common, or too long ago for the IMU. The first two frames always do.
bool IsKeyframe(const VioWindow& window, const KeyframeConfig& config);

}  // namespace mlvi

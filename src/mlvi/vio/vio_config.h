// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/panorama/panoramic_tracker.h"
#include "mlvi/vio/depth_config.h"
#include "mlvi/vio/failure_detector.h"
#include "mlvi/vio/keyframe_policy.h"
#include "mlvi/vio/rest_detector.h"
#include "mlvi/vio/visual_inertial_start.h"
#include "mlvi/vio/window_config.h"

namespace mlvi {

struct VioConfig {
  double radius = 10.0;
  double imu_memory = 5.0;
  PanoramicTrackerConfig tracker;
  WindowConfig window;
  KeyframeConfig keyframe;
  RestConfig rest;
  DepthConfig depth;
  FailureConfig failure;
  VisualInertialStartConfig start;
  void Declare(ConfigDeclaration& d);
};

}  // namespace mlvi

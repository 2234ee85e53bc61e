// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/base/config.h"
#include "mlvi/panorama/compensation.h"

namespace mlvi {

// Which extrinsics are estimated. Never both kinds: a motion of the whole rig is one of all
// cameras.
enum class ExtrinsicsCalibration : int {
  kOff = 0,
  kRig = 1,     // T_body_pano: all cameras move as one
  kCameras = 2  // T_pano_camera of every camera
};

enum class BearingLoss : int { kHuber = 0, kCauchy = 1 };

// The sliding window: what is compared, what is estimated besides motion, and how it is solved.
struct WindowConfig {
  int keyframes = 10;
  Compensation compensation = Compensation::kRay;
  double pixel_sigma = 0.3;
  double pixel_drift = 0.1;
  BearingLoss loss = BearingLoss::kCauchy;
  double loss_scale = 1.0;
  ExtrinsicsCalibration extrinsics = ExtrinsicsCalibration::kCameras;
  double extrinsics_rotation_sigma = 0.001;
  double extrinsics_translation_sigma = 0.002;
  bool time_offset = true;
  double time_offset_sigma = 0.002;
  double time_offset_difference_sigma = 0.0005;
  int max_iterations = 4;
  double min_decrease = 1e-3;
  double min_depth = 0.2;
  double initial_depth = 5.0;
  double min_parallax = 0.01;
  double outlier_sigmas = 5.0;
  double max_relative_depth_sigma = 0.3;
  double max_bias_change = 0.02;
  void Declare(ConfigDeclaration& d);
};

}  // namespace mlvi

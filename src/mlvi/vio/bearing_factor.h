// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>

#include "mlvi/panorama/bearing_residual.h"
#include "mlvi/vio/image_motion.h"

namespace mlvi {

// Two observations of one feature: where it is anchored and what it is compared with.
struct BearingPair {
  PanoramicObservation anchor, target;
  ImageMotion anchor_image = {}, target_image = {};  // constants
  bool same_frame = false;  // two cameras in one set: its pose does not matter
  Compensation mode = Compensation::kRay;
  double radius = 10.0;      // m, of the sphere
  double pixel_sigma = 1.0;  // px
};

// bearing_residual.h as a cost function, residual in sigmas. Parameters (pose_block.h): pose of the
// anchor's frame and of the target's (neither for same_frame), T_body_pano, T_pano_camera of the
// anchor's camera and of the target's (once for one camera), inverse depth (1/m), time offset (s) of
// the anchor's camera and of the target's (once for one camera).
// The window solves by its own normal equations (window_linearization.h), which evaluate the same
// residual; batch problems and tests use this.
class BearingFactor final : public ceres::CostFunction {
 public:
  explicit BearingFactor(const BearingPair& pair);
  // False where the feature lies at the target's origin.
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  bool same_camera() const { return pair_.anchor.camera == pair_.target.camera; }

  BearingPair pair_;
};

}  // namespace mlvi

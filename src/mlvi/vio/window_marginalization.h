// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What leaves the window. The oldest keyframe becomes a prior on what stays, together with what
// features have told about it; a frame that is no keyframe is forgotten, its IMU samples are not.
#pragma once

#include "mlvi/vio/window.h"
#include "mlvi/vio/window_linearization.h"

namespace mlvi {

// What images and IMU have told about the calibration so far, without the rig file, at the present
// values: normal equations in its coordinates. Empty: nothing.
using CalibrationKnowledge = ReducedSystem;

// Of a window that is solved, from the covariance of its calibration; less certain than it says, as
// it is for the time after a failure.
CalibrationKnowledge KnowledgeOf(const VioWindow& window, const WindowConfig& config,
                                 const Eigen::MatrixXd& covariance);

// A prior on a window of one frame: the covariance of its state (coordinates of frame_index), and
// what is known of the present calibration besides the rig file (calibration_prior.h).
WindowPrior FirstPrior(const VioWindow& window, const Matrix15d& covariance,
                       const CalibrationKnowledge& known = {});

// The prior that a linearised problem leaves on everything but its first frame: the Schur
// complement as a square root. Frames that it knows get their present states as prior states.
WindowPrior PriorWithoutFirstFrame(VioWindow& window, const LinearizedWindow& system);

// Takes the first frame out of the window, with the observations of features whose depth is known:
// all of them when the track has ended, those in the older half of the window when it goes on (the
// rest is a feature of its own; no observation counts twice). Other features lose their observation
// in that frame.
void MarginalizeFirstFrame(VioWindow& window, const WindowConfig& config, double gravity);

// Takes a frame out that the prior does not know; its IMU samples go to the next one. Contract:
// neither the first nor the last.
void DropFrame(VioWindow& window, std::size_t index, const WindowConfig& config,
               const ImuSpec& imu);

}  // namespace mlvi

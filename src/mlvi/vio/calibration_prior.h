// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What the rig file says about the calibration that the window estimates. Rotations and time
// offsets are mostly right, now and then plainly wrong: their errors have heavy tails (Cauchy's
// kernel). Where images agree with the file to some sigmas its values hold, also along directions
// that the motion says little about; where they contradict it clearly it is given up. Positions
// have a Gaussian: images say little about them, and whatever else is wrong (shutters, focal
// lengths) ends there when it is let. Time offsets have a part that all cameras share (drivers,
// the IMU's own delay) and now and then one that is a camera's own; the common part is no unknown
// of the window but taken where the sum of both is least. It all stays outside of the window's
// prior, since weights depend on the estimate.
#pragma once

#include "mlvi/vio/window.h"
#include "mlvi/vio/window_linearization.h"

namespace mlvi {

// Adds its cost and its normal equations, reweighted at the present calibration. The cost is the sum
// over rotation and position of every pose that is estimated, and over time offsets (the common
// one, and of each camera the difference to it), of rho(|deviation|^2 / sigma^2) / 2, rho the
// identity for positions. The deviation is from window.nominal.
void AddCalibrationPrior(const VioWindow& window, const WindowConfig& config,
                         LinearizedWindow& system);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mlvi/vio/window.h"

namespace mlvi {

// How far the estimated calibration is from what the rig file says, with standard deviations of the
// estimate.
struct CalibrationDeviation {
  struct Camera {
    double rotation = 0.0, rotation_sigma = 0.0;        // rad
    double translation = 0.0, translation_sigma = 0.0;  // m
  };
  struct TimeOffset {
    double seconds = 0.0, sigma = 0.0;  // s; images are taken this much later than the file says
  };
  bool together = false;        // all cameras move as one, about S: the same deviation for each
  std::vector<Camera> cameras;  // empty: extrinsics are not estimated
  std::vector<TimeOffset> time_offsets;  // per camera; empty: not estimated
};

// `covariance`: of the calibration's coordinates, as `layout` orders them.
CalibrationDeviation DeviationFromNominal(const VioCalibration& calibration,
                                          const VioCalibration& nominal, const WindowLayout& layout,
                                          const Eigen::MatrixXd& covariance);

}  // namespace mlvi

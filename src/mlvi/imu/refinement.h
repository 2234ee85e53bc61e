// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Maximum a posteriori estimate of a short run of states from preintegrated IMU motions, measured
// relative poses and the prior on the biases: the second half of the moving start.
#pragma once

#include <span>
#include <vector>

#include "mlvi/imu/preintegration.h"
#include "mlvi/state/nav_state.h"

namespace mlvi::internal {

// A measured motion T_from_to between neighbouring states, with its covariance in the chart of
// BoxMinus.
struct RelativePose {
  Pose3 T_from_to;
  Matrix6d covariance;
};

struct Refinement {
  std::vector<NavState> states;
  Matrix15d covariance;            // of the last state
  std::vector<Matrix6d> relative;  // of T_last_k for every state k, pose chart; zero for the last
  double chi_square = 0.0;         // of all residuals, whitened
  int degrees_of_freedom = 0;
  int iterations = 0;
  bool converged = false;
};

// Levenberg-Marquardt from `states`, whose first must have heading zero and the origin as position:
// both are held there (levelling.h). `motions[k]` and `steps[k]` lead from state k to state k + 1.
// The biases' prior has mean zero and the sigmas of `imu`.
Refinement RefineStates(std::vector<NavState> states, std::span<const PreintegratedImu> motions,
                        std::span<const RelativePose> steps, const ImuSpec& imu, double gravity);

}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/sized_cost_function.h>

#include "mlvi/factors/pose_block.h"

namespace mlvi {

// A measured relative pose: odometry, loop closures, the edges of g2o files.
//   residual = sqrt_information * LogSe3(T_i_j_measured^-1 * T_world_i^-1 * T_world_j)
// with the logarithm of SE(3) [translation; rotation], as GTSAM's BetweenFactor<Pose3> has it, so
// that objectives of pose graphs compare. The chart's BoxMinus would give other objectives where
// residual rotations are large. Parameters: pose i, pose j (pose_block.h). `sqrt_information` is
// any W with W^T W = covariance^-1.
class BetweenFactor final : public ceres::SizedCostFunction<6, kPoseBlockSize, kPoseBlockSize> {
 public:
  BetweenFactor(const Pose3& T_i_j, const Matrix6d& sqrt_information)
      : T_j_i_measured_(T_i_j.inverse()), sqrt_information_(sqrt_information) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Pose3 T_j_i_measured_;
  Matrix6d sqrt_information_;
};

// Upper triangular W with W^T W = information. Throws ContractViolation unless `information` is
// positive definite.
Matrix6d SqrtInformation(const Matrix6d& information);

}  // namespace mlvi

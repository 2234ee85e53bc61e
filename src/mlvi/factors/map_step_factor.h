// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/sized_cost_function.h>

#include "mlvi/factors/pose_block.h"

namespace mlvi {

// How the local map of an odometry moves on between two of its estimates, i and j. Its place is
// expressed by the pose that it gives the body: M_i where the odometry's estimate i lies in the map
// as it was then, X_i where the body truly was. With a share s of the map's points replaced by
// those seen around X_i, the map of j is a mixture of both:
//   residual = sqrt_information * (LogSe3(M_i^-1 M_j T_i_j^-1) - s LogSe3(M_i^-1 X_i)),
// T_i_j the motion by the odometry, to be whitened by the mixture's covariance,
// s (1 - s) Cov(M_i^-1 X_i).
// Parameters: poses M_i, X_i, M_j (pose_block.h).
class MapStepFactor final
    : public ceres::SizedCostFunction<6, kPoseBlockSize, kPoseBlockSize, kPoseBlockSize> {
 public:
  // `share` in [0, 1]; `sqrt_information` is any W with W^T W = covariance^-1, pose chart of M_i.
  MapStepFactor(const Pose3& T_i_j, double share, const Matrix6d& sqrt_information)
      : T_i_j_(T_i_j), share_(share), sqrt_information_(sqrt_information) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Pose3 T_i_j_;
  double share_;
  Matrix6d sqrt_information_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/sized_cost_function.h>

#include "mlvi/factors/pose_block.h"
#include "mlvi/imu/preintegration.h"

namespace mlvi {

// Preintegrated IMU motion between two states with the walk of the biases (Forster et al. 2017, Eq.
// 45), whitened by its covariance: residual = L^-1 [p, v, R, ba, bg] with L L^T = covariance. See
// imu/imu_residual.h. Parameters: pose i, velocity i, bias i, pose j, velocity j, bias j
// (pose_block.h); world with gravity (0, 0, -g).
class ImuFactor final
    : public ceres::SizedCostFunction<15, kPoseBlockSize, kVelocityBlockSize, kBiasBlockSize,
                                      kPoseBlockSize, kVelocityBlockSize, kBiasBlockSize> {
 public:
  // `gravity` in m/s^2, magnitude. Biases far from preintegrated.bias (a rotation of several
  // degrees over the interval) call for preintegrating anew: the correction is of first order.
  ImuFactor(const PreintegratedImu& preintegrated, double gravity);

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

  const PreintegratedImu& preintegrated() const { return preintegrated_; }

 private:
  PreintegratedImu preintegrated_;
  double gravity_;
  Matrix15d sqrt_information_;
};

}  // namespace mlvi

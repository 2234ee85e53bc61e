// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/sized_cost_function.h>

#include "mlvi/factors/pose_block.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// A pose known with some certainty: residual = sqrt_information * LogSe3(T_world_body_prior^-1 *
// T_world_body), order [translation; rotation] in the frame of the prior pose. Parameter: pose.
class PosePriorFactor final : public ceres::SizedCostFunction<6, kPoseBlockSize> {
 public:
  PosePriorFactor(const Pose3& T_world_body, const Matrix6d& sqrt_information)
      : T_body_world_prior_(T_world_body.inverse()), sqrt_information_(sqrt_information) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Pose3 T_body_world_prior_;
  Matrix6d sqrt_information_;
};

// A Euclidean block (velocity, bias) known with some certainty: residual = sqrt_information * (x -
// mean). `sqrt_information` is any matrix with as many columns as `mean` has rows. Parameter: the
// block.
class VectorPriorFactor final : public ceres::CostFunction {
 public:
  VectorPriorFactor(const Eigen::VectorXd& mean, const Eigen::MatrixXd& sqrt_information);

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::VectorXd mean_;
  Eigen::MatrixXd sqrt_information_;
};

// A whole state known with some certainty, correlations included: residual = sqrt_information *
// [LogSe3(T_world_body_prior^-1 T_world_body); v - v_prior; bias - bias_prior].
// Parameters: pose, velocity, bias.
class NavPriorFactor final
    : public ceres::SizedCostFunction<15, kPoseBlockSize, kVelocityBlockSize, kBiasBlockSize> {
 public:
  // `sqrt_information` in the order of the residual.
  NavPriorFactor(const NavState& state, const Matrix15d& sqrt_information)
      : state_(state), sqrt_information_(sqrt_information) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  NavState state_;
  Matrix15d sqrt_information_;
};

}  // namespace mlvi

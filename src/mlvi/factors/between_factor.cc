// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/between_factor.h"

#include <Eigen/Cholesky>

#include "mlvi/base/error.h"

namespace mlvi {

bool BetweenFactor::Evaluate(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const Pose3 T_world_i = LoadPose(parameters[0]), T_world_j = LoadPose(parameters[1]);
  const Pose3 T_i_j = T_world_i.inverse() * T_world_j;
  const Vector6d error = LogSe3(T_j_i_measured_ * T_i_j);
  Eigen::Map<Vector6d>{residuals}.noalias() = sqrt_information_ * error;
  if (jacobians == nullptr) return true;

  // T_j Exp(d) moves the error by Jr^-1 d; T_i Exp(d) acts like T_j Exp(-Ad(T_j_i) d).
  const Matrix6d J = sqrt_information_ * RightJacobianInverseSe3(error);
  if (jacobians[0] != nullptr) {
    const Matrix6d J_i = -J * AdjointSe3(T_i_j.inverse());
    StorePoseJacobian<6>(J_i, parameters[0], jacobians[0]);
  }
  if (jacobians[1] != nullptr) StorePoseJacobian<6>(J, parameters[1], jacobians[1]);
  return true;
}

Matrix6d SqrtInformation(const Matrix6d& information) {
  const Eigen::LLT<Matrix6d> llt(information);
  MLVI_CHECK(llt.info() == Eigen::Success,
             "information with diagonal {} {} {} {} {} {} is not positive definite",
             information(0, 0), information(1, 1), information(2, 2), information(3, 3),
             information(4, 4), information(5, 5));
  return llt.matrixU();
}

}  // namespace mlvi

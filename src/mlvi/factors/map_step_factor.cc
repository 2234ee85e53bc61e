// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/map_step_factor.h"

namespace mlvi {

bool MapStepFactor::Evaluate(const double* const* parameters, double* residuals,
                             double** jacobians) const {
  const Pose3 map_i = LoadPose(parameters[0]), body_i = LoadPose(parameters[1]),
              map_j = LoadPose(parameters[2]);
  const Pose3 moved = map_i.inverse() * map_j * T_i_j_.inverse();
  const Pose3 seen = map_i.inverse() * body_i;
  const Vector6d step = LogSe3(moved), off = LogSe3(seen);
  Eigen::Map<Vector6d>{residuals}.noalias() = sqrt_information_ * (step - share_ * off);
  if (jacobians == nullptr) return true;

  // Poses behind move a logarithm by Jr^-1; M_i Exp(d) acts like a step of -Ad(T^-1) d behind T =
  // M_i^-1 (...).
  const Matrix6d J_step = sqrt_information_ * RightJacobianInverseSe3(step);
  const Matrix6d J_off = share_ * sqrt_information_ * RightJacobianInverseSe3(off);
  if (jacobians[0] != nullptr) {
    const Matrix6d J = J_off * AdjointSe3(seen.inverse()) - J_step * AdjointSe3(moved.inverse());
    StorePoseJacobian<6>(J, parameters[0], jacobians[0]);
  }
  if (jacobians[1] != nullptr) StorePoseJacobian<6>(-J_off, parameters[1], jacobians[1]);
  if (jacobians[2] != nullptr) {
    StorePoseJacobian<6>(J_step * AdjointSe3(T_i_j_), parameters[2], jacobians[2]);
  }
  return true;
}

}  // namespace mlvi

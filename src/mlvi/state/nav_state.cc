// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/state/nav_state.h"

namespace mlvi {

NavState BoxPlus(const NavState& state, const Vector15d& delta) {
  NavState result = state;
  result.T_world_body =
      Pose3(state.T_world_body.rotation() * ExpSo3(delta.segment<3>(nav_index::kRotation)),
            state.T_world_body.translation() + delta.segment<3>(nav_index::kPosition));
  result.v_world_body += delta.segment<3>(nav_index::kVelocity);
  result.bias.accelerometer += delta.segment<3>(nav_index::kAccelerometerBias);
  result.bias.gyroscope += delta.segment<3>(nav_index::kGyroscopeBias);
  return result;
}

Vector15d BoxMinus(const NavState& a, const NavState& b) {
  Vector15d delta;
  delta << a.T_world_body.translation() - b.T_world_body.translation(),
      a.v_world_body - b.v_world_body,
      LogSo3(b.T_world_body.rotation().conjugate() * a.T_world_body.rotation()),
      a.bias.accelerometer - b.bias.accelerometer, a.bias.gyroscope - b.bias.gyroscope;
  return delta;
}

Matrix6d PoseChartCovariance(const Eigen::Matrix3d& R_world_body, const Matrix15d& covariance) {
  Eigen::Matrix<double, 6, 15> J = Eigen::Matrix<double, 6, 15>::Zero();
  J.block<3, 3>(0, nav_index::kPosition) = R_world_body.transpose();
  J.block<3, 3>(3, nav_index::kRotation).setIdentity();
  return J * covariance * J.transpose();
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/pose_block.h"

namespace mlvi {
namespace {

// q (x) [v, 0] = Q(q) v with quaternions stored x y z w.
Eigen::Matrix<double, 4, 3> QuaternionTimesVector(const double* q) {
  Eigen::Matrix<double, 4, 3> Q;
  Q << q[3], -q[2], q[1],  //
      q[2], q[3], -q[0],   //
      -q[1], q[0], q[3],   //
      -q[0], -q[1], -q[2];
  return Q;
}

}  // namespace

Eigen::Matrix<double, 6, 7> PoseMinusJacobian(const double* block) {
  Eigen::Matrix<double, 6, 7> J = Eigen::Matrix<double, 6, 7>::Zero();
  J.topLeftCorner<3, 3>() = LoadPose(block).R().transpose();
  J.bottomRightCorner<3, 4>() = 2.0 * QuaternionTimesVector(block + 3).transpose();
  return J;
}

void PoseManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  StorePose(BoxPlus(LoadPose(x), Eigen::Map<const Vector6d>(delta)), x_plus_delta);
}

void PoseManifold::PlusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
  J.setZero();
  J.topLeftCorner<3, 3>() = LoadPose(x).R();
  J.bottomRightCorner<4, 3>() = 0.5 * QuaternionTimesVector(x + 3);
}

}  // namespace mlvi

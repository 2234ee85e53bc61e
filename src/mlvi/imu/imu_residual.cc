// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/imu_residual.h"

#include <Eigen/Cholesky>

#include "mlvi/base/error.h"
#include "mlvi/geometry/so3.h"

namespace mlvi {
namespace {

using nav_index::kAccelerometerBias;
using nav_index::kGyroscopeBias;
using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

// Variances below these are raised to them: nanometres and the like, far under every sensor.
Vector15d SmallestVariance() {
  Vector15d smallest;
  smallest << Eigen::Vector3d::Constant(1e-18), Eigen::Vector3d::Constant(1e-16),
      Eigen::Vector3d::Constant(1e-18), Eigen::Vector3d::Constant(1e-12),
      Eigen::Vector3d::Constant(1e-14);
  return smallest;
}

}  // namespace

ImuResidual EvaluateImuResidual(const NavState& first, const NavState& second,
                                const PreintegratedImu& preintegrated, double gravity) {
  const PreintegratedImu delta = CorrectedForBias(preintegrated, first.bias);
  const double dt = delta.dt();
  const Eigen::Vector3d g(0.0, 0.0, -gravity);
  const Eigen::Matrix3d Rt = first.T_world_body.R().transpose();
  const Eigen::Quaterniond R_first_second =
      first.T_world_body.rotation().conjugate() * second.T_world_body.rotation();
  const Eigen::Vector3d dp =
      Rt * (second.T_world_body.translation() - first.T_world_body.translation() -
            dt * first.v_world_body - 0.5 * dt * dt * g);
  const Eigen::Vector3d dv = Rt * (second.v_world_body - first.v_world_body - dt * g);
  const Eigen::Vector3d dR = LogSo3(delta.delta_R.conjugate() * R_first_second);
  ImuResidual r;
  r.value << dp - delta.delta_p, dv - delta.delta_v, dR,
      second.bias.accelerometer - first.bias.accelerometer,
      second.bias.gyroscope - first.bias.gyroscope;

  r.by_first.setZero();
  r.by_second.setIdentity();
  r.by_first.block<3, 3>(kPosition, kPosition) = -Rt;
  r.by_second.block<3, 3>(kPosition, kPosition) = Rt;
  r.by_first.block<3, 3>(kPosition, kVelocity) = -dt * Rt;
  r.by_first.block<3, 3>(kPosition, kRotation) = Hat(dp);
  r.by_first.block<3, 3>(kPosition, kAccelerometerBias) = -delta.dp_dba;
  r.by_first.block<3, 3>(kPosition, kGyroscopeBias) = -delta.dp_dbg;
  r.by_first.block<3, 3>(kVelocity, kVelocity) = -Rt;
  r.by_second.block<3, 3>(kVelocity, kVelocity) = Rt;
  r.by_first.block<3, 3>(kVelocity, kRotation) = Hat(dv);
  r.by_first.block<3, 3>(kVelocity, kAccelerometerBias) = -delta.dv_dba;
  r.by_first.block<3, 3>(kVelocity, kGyroscopeBias) = -delta.dv_dbg;
  const Eigen::Matrix3d J_inverse = RightJacobianInverseSo3(dR);
  // The bias turns delta_R by Exp(J d_bg) on its right: the chain rule passes through Jr at that
  // point.
  const Eigen::Vector3d turned =
      delta.dR_dbg * (first.bias.gyroscope - preintegrated.bias.gyroscope);
  r.by_second.block<3, 3>(kRotation, kRotation) = J_inverse;
  r.by_first.block<3, 3>(kRotation, kRotation) =
      -J_inverse * R_first_second.toRotationMatrix().transpose();
  r.by_first.block<3, 3>(kRotation, kGyroscopeBias) =
      -J_inverse * ExpSo3(-dR).toRotationMatrix() * RightJacobianSo3(turned) * delta.dR_dbg;
  r.by_first.bottomRightCorner<6, 6>() = -Eigen::Matrix<double, 6, 6>::Identity();
  return r;
}

Matrix15d SqrtInformation(const PreintegratedImu& preintegrated) {
  Matrix15d covariance = preintegrated.covariance;
  covariance.diagonal() = covariance.diagonal().cwiseMax(SmallestVariance()).eval();
  const Eigen::LLT<Matrix15d> llt(covariance);
  MLVI_CHECK(covariance.allFinite() && llt.info() == Eigen::Success,
             "the covariance of the preintegrated motion over {:.3f} s is not positive definite",
             preintegrated.dt());
  return llt.matrixL().solve(Matrix15d(Matrix15d::Identity()));
}

}  // namespace mlvi

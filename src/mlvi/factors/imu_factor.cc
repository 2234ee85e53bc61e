// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/imu_factor.h"

#include "mlvi/imu/imu_residual.h"

namespace mlvi {
namespace {

using nav_index::kAccelerometerBias;
using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

NavState LoadState(const double* pose, const double* velocity, const double* bias, Time stamp) {
  NavState state;
  state.stamp = stamp;
  state.T_world_body = LoadPose(pose);
  state.v_world_body = Eigen::Map<const Eigen::Vector3d>(velocity);
  state.bias.accelerometer = Eigen::Map<const Eigen::Vector3d>(bias);
  state.bias.gyroscope = Eigen::Map<const Eigen::Vector3d>(bias + 3);
  return state;
}

// Distributes the Jacobian by an error state (position in the world) over its three blocks
// (position in the body frame).
void StoreJacobians(const Matrix15d& J, const NavState& state, const double* pose,
                    double** blocks) {
  if (blocks[0] != nullptr) {
    Eigen::Matrix<double, 15, 6> by_pose;
    by_pose << J.middleCols<3>(kPosition) * state.T_world_body.R(), J.middleCols<3>(kRotation);
    StorePoseJacobian<15>(by_pose, pose, blocks[0]);
  }
  if (blocks[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 15, 3, Eigen::RowMajor>>{blocks[1]} =
        J.middleCols<3>(kVelocity);
  }
  if (blocks[2] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 15, 6, Eigen::RowMajor>>{blocks[2]} =
        J.middleCols<6>(kAccelerometerBias);
  }
}

}  // namespace

ImuFactor::ImuFactor(const PreintegratedImu& preintegrated, double gravity)
    : preintegrated_(preintegrated),
      gravity_(gravity),
      sqrt_information_(SqrtInformation(preintegrated)) {}

bool ImuFactor::Evaluate(const double* const* parameters, double* residuals,
                         double** jacobians) const {
  const NavState first =
      LoadState(parameters[0], parameters[1], parameters[2], preintegrated_.from);
  const NavState second = LoadState(parameters[3], parameters[4], parameters[5], preintegrated_.to);
  const ImuResidual residual = EvaluateImuResidual(first, second, preintegrated_, gravity_);
  Eigen::Map<Vector15d>{residuals}.noalias() = sqrt_information_ * residual.value;
  if (jacobians == nullptr) return true;
  StoreJacobians(sqrt_information_ * residual.by_first, first, parameters[0], jacobians);
  StoreJacobians(sqrt_information_ * residual.by_second, second, parameters[3], jacobians + 3);
  return true;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/prior_factor.h"

#include "mlvi/base/error.h"

namespace mlvi {

bool PosePriorFactor::Evaluate(const double* const* parameters, double* residuals,
                               double** jacobians) const {
  const Vector6d error = LogSe3(T_body_world_prior_ * LoadPose(parameters[0]));
  Eigen::Map<Vector6d>{residuals}.noalias() = sqrt_information_ * error;
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    const Matrix6d J = sqrt_information_ * RightJacobianInverseSe3(error);
    StorePoseJacobian<6>(J, parameters[0], jacobians[0]);
  }
  return true;
}

VectorPriorFactor::VectorPriorFactor(const Eigen::VectorXd& mean,
                                     const Eigen::MatrixXd& sqrt_information)
    : mean_(mean), sqrt_information_(sqrt_information) {
  MLVI_CHECK(sqrt_information.cols() == mean.rows(), "{} columns for a vector of {}",
             sqrt_information.cols(), mean.rows());
  set_num_residuals(static_cast<int>(sqrt_information.rows()));
  mutable_parameter_block_sizes()->push_back(static_cast<int>(mean.rows()));
}

bool VectorPriorFactor::Evaluate(const double* const* parameters, double* residuals,
                                 double** jacobians) const {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Eigen::VectorXd> x(parameters[0], mean_.rows());
  Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = sqrt_information_ * (x - mean_);
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    Eigen::Map<RowMajor>(jacobians[0], num_residuals(), mean_.rows()) = sqrt_information_;
  }
  return true;
}

bool NavPriorFactor::Evaluate(const double* const* parameters, double* residuals,
                              double** jacobians) const {
  using Eigen::Map, Eigen::Vector3d;
  Vector15d error;
  error << LogSe3(state_.T_world_body.inverse() * LoadPose(parameters[0])),
      Map<const Vector3d>(parameters[1]) - state_.v_world_body,
      Map<const Vector3d>(parameters[2]) - state_.bias.accelerometer,
      Map<const Vector3d>(parameters[2] + 3) - state_.bias.gyroscope;
  Map<Vector15d>{residuals}.noalias() = sqrt_information_ * error;
  if (jacobians == nullptr) return true;
  if (jacobians[0] != nullptr) {
    const Eigen::Matrix<double, 15, 6> J =
        sqrt_information_.leftCols<6>() * RightJacobianInverseSe3(error.head<6>());
    StorePoseJacobian<15>(J, parameters[0], jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    Map<Eigen::Matrix<double, 15, 3, Eigen::RowMajor>>{jacobians[1]} =
        sqrt_information_.middleCols<3>(6);
  }
  if (jacobians[2] != nullptr) {
    Map<Eigen::Matrix<double, 15, 6, Eigen::RowMajor>>{jacobians[2]} =
        sqrt_information_.rightCols<6>();
  }
  return true;
}

}  // namespace mlvi

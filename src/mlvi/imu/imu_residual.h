// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The residual of two states against a preintegrated motion (Forster et al. 2017, Eq. 45), as plain
// functions: the moving start and the factor of the estimators share it.
#pragma once

#include "mlvi/imu/preintegration.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

struct ImuResidual {
  // States minus preintegrated motion, in the order p, v, R, ba, bg; position, velocity and
  // rotation in the first body frame (rotation in that of the second). Its covariance is
  // PreintegratedImu::covariance.
  Vector15d value;
  // By the error states (BoxPlus of NavState) of both.
  Matrix15d by_first, by_second;
};

// `gravity` in m/s^2, magnitude. The delta is corrected to the bias of `first` to first order.
ImuResidual EvaluateImuResidual(const NavState& first, const NavState& second,
                                const PreintegratedImu& preintegrated, double gravity);

// L^-1 of the covariance L L^T: whitens residual and Jacobians. A random walk of zero leaves a
// variance of zero, which is raised to a tiny one so that the bias is in effect constant. Throws
// ContractViolation if the covariance is not finite.
Matrix15d SqrtInformation(const PreintegratedImu& preintegrated);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/motion_guess.h"

#include <Eigen/Cholesky>

#include "mlvi/imu/propagation.h"

namespace mlvi {
namespace {

using Rows = Eigen::Matrix<double, 6, kFilterSize>;

// The guess carried on to both ends of the propagation by the IMU's own relative motion there.
Pose3 Completed(const MotionPrior& guess, std::span<const NavState> states) {
  const Pose3& T_world_last = states.front().T_world_body;
  const Pose3& T_world_end = states.back().T_world_body;
  const Pose3 T_last_from = T_world_last.inverse() * InterpolatePose(states, guess.from);
  const Pose3 T_to_end = InterpolatePose(states, guess.to).inverse() * T_world_end;
  return T_last_from * guess.T_from_to * T_to_end;
}

}  // namespace

StateEstimate FuseMotionGuess(const StateEstimate& last, const Prediction& prediction,
                              const MotionPrior& guess) {
  const NavState& end = prediction.end.mean.nav;
  const Pose3 T_last_end = last.mean.nav.T_world_body.inverse() * end.T_world_body;
  const Eigen::Matrix3d R_last = last.mean.nav.T_world_body.R();
  const Eigen::Matrix3d R_end = end.T_world_body.R();
  // Innovation in the chart of the measured pose; predicted and measured are close, so the rotation
  // part of the Jacobian of BoxMinus is taken as the identity.
  const Vector6d innovation = -BoxMinus(T_last_end, Completed(guess, prediction.trajectory));
  // The translation of T_last_end seen in the axes of its own rotation, as the chart has it:
  //   R_end^T (p_end - p_last - [..] ), d/d(theta_last) of R_end^T R_last (R_last^T (p_end -
  //   p_last)).
  Rows H_last = Rows::Zero(), H_end = Rows::Zero();
  H_end.block<3, 3>(0, nav_index::kPosition) = R_end.transpose();
  H_end.block<3, 3>(3, nav_index::kRotation).setIdentity();
  H_last.block<3, 3>(0, nav_index::kPosition) = -R_end.transpose();
  H_last.block<3, 3>(0, nav_index::kRotation) =
      R_end.transpose() * R_last * Hat(T_last_end.translation());
  H_last.block<3, 3>(3, nav_index::kRotation) = -R_end.transpose() * R_last;

  const FilterMatrix cross =
      last.covariance * prediction.transition.transpose();  // E[d_last d_end^T]
  const Eigen::Matrix<double, kFilterSize, 6> end_gain_part =
      cross.transpose() * H_last.transpose() + prediction.end.covariance * H_end.transpose();
  const Eigen::Matrix<double, kFilterSize, 6> last_gain_part =
      last.covariance * H_last.transpose() + cross * H_end.transpose();
  const Matrix6d S = H_last * last_gain_part + H_end * end_gain_part + guess.covariance;
  const Eigen::Matrix<double, kFilterSize, 6> K =
      S.ldlt().solve(end_gain_part.transpose()).transpose();
  StateEstimate result{BoxPlus(prediction.end.mean, FilterVector(K * innovation)),
                       prediction.end.covariance - K * S * K.transpose()};
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  return result;
}

}  // namespace mlvi

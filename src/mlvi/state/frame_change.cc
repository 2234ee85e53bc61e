// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/state/frame_change.h"

namespace mlvi {

NavState InFrame(const Pose3& T_new_old, const NavState& state) {
  NavState result = state;
  result.T_world_body = T_new_old * state.T_world_body;
  result.v_world_body = T_new_old.rotation() * state.v_world_body;
  return result;
}

OdometryEstimate InFrame(const Pose3& T_new_old, const OdometryEstimate& estimate) {
  const Eigen::Matrix3d R = T_new_old.R();
  // Position and velocity errors have world axes; the other ones belong to the body.
  Matrix15d turn = Matrix15d::Identity();
  turn.block<3, 3>(nav_index::kPosition, nav_index::kPosition) = R;
  turn.block<3, 3>(nav_index::kVelocity, nav_index::kVelocity) = R;
  OdometryEstimate result = estimate;
  result.state = InFrame(T_new_old, estimate.state);
  result.covariance = turn * estimate.covariance * turn.transpose();
  result.degeneracy.translation_axes = R * estimate.degeneracy.translation_axes;
  result.degeneracy.rotation_axes = R * estimate.degeneracy.rotation_axes;
  return result;
}

}  // namespace mlvi

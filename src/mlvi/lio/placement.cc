// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

// Standard deviation of an angle of which nothing is known.
constexpr double kAnyAngle = std::numbers::pi / std::numbers::sqrt3;
// Nothing walks farther in the pauses of a recording; keeps information matrices regular.
constexpr double kAnyDistance = 1000.0;  // m

}  // namespace

Placement PlaceOf(const StateEstimate& last, const StateEstimate& prediction, double silent,
                  double unwatched, const LioConfig& config) {
  if (silent <= config.gap.max_silence) {
    return {prediction.mean.nav.T_world_body, PoseCovariance(prediction.covariance)};
  }
  const double way = std::min(config.start.max_speed * unwatched, kAnyDistance);
  const double turn = std::min(config.gap.rate_sigma * silent, kAnyAngle);
  Placement placement{last.mean.nav.T_world_body, PoseCovariance(last.covariance)};
  placement.covariance.diagonal().head<3>().array() += way * way;
  placement.covariance.diagonal().tail<3>().array() += turn * turn;
  return placement;
}

Pose3 WorldOfStart(const Pose3& T_level_body, const Pose3& place) {
  const Eigen::Matrix3d R = place.R() * T_level_body.R().transpose();
  const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  const Eigen::Quaterniond R_world_level = ExpSo3(Eigen::Vector3d(0.0, 0.0, yaw));
  return Pose3(R_world_level, place.translation() - R_world_level * T_level_body.translation());
}

Matrix6d PlacementError(const Placement& placement, const Pose3& T_world_body) {
  // Columns: shift of the world, turn about the vertical through the place.
  const Eigen::Vector3d up_place = placement.T_world_body.R().transpose().col(2);
  Eigen::Matrix<double, 4, 6> freedom = Eigen::Matrix<double, 4, 6>::Zero();
  freedom.topLeftCorner<3, 3>().setIdentity();
  freedom.block<1, 3>(3, 3) = up_place.transpose();
  const Eigen::Matrix4d covariance = freedom * placement.covariance * freedom.transpose();
  const Eigen::Vector3d lever = T_world_body.translation() - placement.T_world_body.translation();
  Eigen::Matrix<double, 6, 4> J = Eigen::Matrix<double, 6, 4>::Zero();
  J.topLeftCorner<3, 3>().setIdentity();
  J.block<3, 1>(0, 3) = Eigen::Vector3d::UnitZ().cross(lever);
  J.block<3, 1>(3, 3) = T_world_body.R().transpose().col(2);
  return J * covariance * J.transpose();
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/levelling.h"

#include <cmath>

#include "mlvi/geometry/so3.h"

namespace mlvi {

double Heading::Of(const Eigen::Matrix3d& R_world_body) const {
  const Eigen::Vector3d c = R_world_body.col(axis_);
  return axis_ == 0 ? std::atan2(c.y(), c.x()) : std::atan2(-c.x(), c.y());
}

Eigen::RowVector3d Heading::Derivative(const Eigen::Matrix3d& R_world_body) const {
  const Eigen::Vector3d c = R_world_body.col(axis_);
  const Eigen::Matrix3d dc = -R_world_body * Hat(Eigen::Vector3d::Unit(axis_));
  return (c.x() * dc.row(1) - c.y() * dc.row(0)) / c.head<2>().squaredNorm();
}

Eigen::Quaterniond LevelRotation(const Eigen::Vector3d& up_body) {
  const Eigen::Vector3d up = up_body.normalized();
  const Eigen::Quaterniond level = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  const double heading = Heading(up).Of(level.toRotationMatrix());
  return (ExpSo3({0.0, 0.0, -heading}) * level).normalized();
}

}  // namespace mlvi

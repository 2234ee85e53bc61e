// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/point_factors.h"

#include <cmath>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

void CheckUnit(const Eigen::Vector3d& v, double sigma) {
  MLVI_CHECK(std::abs(v.squaredNorm() - 1.0) < 1e-6, "a direction must have unit length, got {}",
             v.norm());
  MLVI_CHECK(sigma > 0.0, "sigma must be positive, got {}", sigma);
}

// d(T p) / d(chart of T).
Eigen::Matrix<double, 3, 6> TransformJacobian(const Pose3& T, const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> J;
  J << T.R(), -T.R() * Hat(p);
  return J;
}

}  // namespace

PointToPlaneFactor::PointToPlaneFactor(const Eigen::Vector3d& point_body,
                                       const Eigen::Vector3d& normal_world, double offset,
                                       double sigma)
    : point_body_(point_body),
      weighted_normal_(normal_world / sigma),
      weighted_offset_(offset / sigma) {
  CheckUnit(normal_world, sigma);
}

bool PointToPlaneFactor::Evaluate(const double* const* parameters, double* residuals,
                                  double** jacobians) const {
  const Pose3 T_world_body = LoadPose(parameters[0]);
  residuals[0] = weighted_normal_.dot(T_world_body * point_body_) + weighted_offset_;
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  const Eigen::Matrix<double, 1, 6> J =
      weighted_normal_.transpose() * TransformJacobian(T_world_body, point_body_);
  StorePoseJacobian<1>(J, parameters[0], jacobians[0]);
  return true;
}

PointToLineFactor::PointToLineFactor(const Eigen::Vector3d& point_body,
                                     const Eigen::Vector3d& anchor_world,
                                     const Eigen::Vector3d& direction_world, double sigma)
    : point_body_(point_body), anchor_world_(anchor_world) {
  CheckUnit(direction_world, sigma);
  const Eigen::Vector3d across = direction_world.unitOrthogonal();
  weighted_across_ << across.transpose() / sigma, direction_world.cross(across).transpose() / sigma;
}

bool PointToLineFactor::Evaluate(const double* const* parameters, double* residuals,
                                 double** jacobians) const {
  const Pose3 T_world_body = LoadPose(parameters[0]);
  Eigen::Map<Eigen::Vector2d>{residuals} =
      weighted_across_ * (T_world_body * point_body_ - anchor_world_);
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  const Eigen::Matrix<double, 2, 6> J =
      weighted_across_ * TransformJacobian(T_world_body, point_body_);
  StorePoseJacobian<2>(J, parameters[0], jacobians[0]);
  return true;
}

}  // namespace mlvi

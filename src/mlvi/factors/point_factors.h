// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Scan-to-map residuals on one pose block.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "mlvi/factors/pose_block.h"

namespace mlvi {

// Signed distance of a point to a plane of the map over its sigma:
//   residual = (n . (T_world_body p_body) + d) / sigma.
// Parameter: pose (pose_block.h).
class PointToPlaneFactor final : public ceres::SizedCostFunction<1, kPoseBlockSize> {
 public:
  // `point_body` in m; `normal_world` of unit length and `offset` in m describe the plane n . x + d
  // = 0; `sigma` > 0 in m.
  PointToPlaneFactor(const Eigen::Vector3d& point_body, const Eigen::Vector3d& normal_world,
                     double offset, double sigma);

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector3d point_body_, weighted_normal_;
  double weighted_offset_;
};

// Offset of a point from a line of the map, in two fixed directions across it, over its sigma:
//   residual = B^T (T_world_body p_body - a) / sigma,   B the 3 x 2 orthonormal complement of the
//   direction.
// Unlike the distance it is smooth on the line itself, and its norm is the distance.
// Parameter: pose (pose_block.h).
class PointToLineFactor final : public ceres::SizedCostFunction<2, kPoseBlockSize> {
 public:
  // `point_body` in m; the line passes through `anchor_world` (m) along the unit vector
  // `direction_world`; `sigma` > 0 in m.
  PointToLineFactor(const Eigen::Vector3d& point_body, const Eigen::Vector3d& anchor_world,
                    const Eigen::Vector3d& direction_world, double sigma);

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  Eigen::Vector3d point_body_, anchor_world_;
  Eigen::Matrix<double, 2, 3> weighted_across_;
};

}  // namespace mlvi

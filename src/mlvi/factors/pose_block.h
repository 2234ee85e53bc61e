// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Parameter blocks of the estimators. A pose is [px py pz qx qy qz qw] (T_world_body) with the
// chart of Pose3's BoxPlus; velocity is 3 and bias 6 doubles [accelerometer, gyroscope], Euclidean.
//
// Cost functions compute Jacobians in the chart ("local"), which is where the mathematics is done,
// and lift them to Ceres' ambient coordinates through MinusJacobian; Ceres and the smoother bring
// them back through PlusJacobian, and MinusJacobian * PlusJacobian = I makes the round trip exact.
#pragma once

#include <Eigen/Core>

#include "mlvi/geometry/pose3.h"
#include "mlvi/solver/manifold.h"

namespace mlvi {

inline constexpr int kPoseBlockSize = 7, kVelocityBlockSize = 3, kBiasBlockSize = 6;

inline Pose3 LoadPose(const double* block) {
  const Eigen::Map<const Eigen::Vector3d> p(block);
  const Eigen::Map<const Eigen::Quaterniond> q(block + 3);
  return Pose3(q, p);
}

inline void StorePose(const Pose3& pose, double* block) {
  Eigen::Map<Eigen::Vector3d>{block} = pose.translation();
  Eigen::Map<Eigen::Vector4d>(block + 3) = pose.rotation().coeffs();
}

// d(chart at x) / d(ambient) at x, 6 x 7, for a unit quaternion.
Eigen::Matrix<double, 6, 7> PoseMinusJacobian(const double* block);

class PoseManifold final : public Manifold {
 public:
  int AmbientSize() const override { return kPoseBlockSize; }
  int TangentSize() const override { return 6; }
  void Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  void PlusJacobian(const double* x, double* jacobian) const override;
};

// Writes the ambient Jacobian (rows x 7, row-major) of a residual whose local Jacobian is `local`
// (rows x 6).
template <int kRows>
void StorePoseJacobian(const Eigen::Matrix<double, kRows, 6>& local, const double* block,
                       double* jacobian) {
  Eigen::Map<Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>>(jacobian).noalias() =
      local * PoseMinusJacobian(block);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "mlvi/geometry/so3.h"

namespace mlvi {

// A rigid transform of SE(3). Named T_a_b it maps a point of frame b to frame a: p_a = T_a_b * p_b;
// it is also the pose of b in a. The quaternion is kept normalised by every operation.
class Pose3 {
 public:
  Pose3() = default;
  Pose3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  static Pose3 FromMatrix(const Eigen::Matrix4d& m) {
    return Pose3(Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())),
                 m.topRightCorner<3, 1>());
  }
  static Pose3 FromTranslation(const Eigen::Vector3d& t) {
    return Pose3(Eigen::Quaterniond::Identity(), t);
  }

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d R() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  Pose3 inverse() const {
    const Eigen::Quaterniond inverse = rotation_.conjugate();
    return Pose3(inverse, -(inverse * translation_));
  }
  Pose3 operator*(const Pose3& other) const {
    return Pose3(rotation_ * other.rotation_, rotation_ * other.translation_ + translation_);
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation_ * point + translation_;
  }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// The SE(3) exponential and logarithm; tangent vectors are [translation; rotation].
Pose3 ExpSe3(const Vector6d& xi);
Vector6d LogSe3(const Pose3& pose);
// Ad_T with T Exp(xi) T^-1 = Exp(Ad_T xi).
Matrix6d AdjointSe3(const Pose3& pose);
// Exp(xi + d) = Exp(xi) Exp(Jr(xi) d) to first order, and its inverse.
Matrix6d RightJacobianSe3(const Vector6d& xi);
Matrix6d RightJacobianInverseSe3(const Vector6d& xi);

// Translation linear, rotation along the geodesic, from a (0) to b (1): what deskewing uses between
// close poses.
Pose3 Interpolate(const Pose3& a, const Pose3& b, double alpha);

// The chart of a pose estimate, used by every factor, covariance and degeneracy report:
//   T boxplus [dp; dtheta] = (p + R dp, R Exp(dtheta)),   T1 boxminus T0 = [R0^T (p1 - p0); Log(R0^T R1)].
// Both parts are in the frame of the pose itself (right perturbation), so a global change of frame
// leaves Jacobians of relative measurements alone.
Pose3 BoxPlus(const Pose3& pose, const Vector6d& delta);
Vector6d BoxMinus(const Pose3& a, const Pose3& b);

}  // namespace mlvi

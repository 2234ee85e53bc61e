// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/pose3.h"

#include <cmath>

namespace mlvi {
namespace {

// The off-diagonal block of the left Jacobian of SE(3) (Barfoot and Furgale 2014, Eq. 102).
Eigen::Matrix3d LeftJacobianCoupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi) {
  const double t2 = phi.squaredNorm();
  const double t = std::sqrt(t2);
  const Eigen::Matrix3d P = Hat(phi), Q = Hat(rho);
  double a = 1.0 / 6.0 - t2 / 120.0;
  double b = 1.0 / 24.0 - t2 / 720.0;
  double c = 1.0 / 120.0 - t2 / 2520.0;
  if (t >= 0.05) {  // beyond the reach of the series; below it the closed forms cancel
    const double s = std::sin(t), co = std::cos(t), t4 = t2 * t2;
    a = (t - s) / (t2 * t);
    b = (t2 + 2.0 * co - 2.0) / (2.0 * t4);
    c = (2.0 * t - 3.0 * s + t * co) / (2.0 * t4 * t);
  } else {
    a += t2 * t2 / 5040.0;
    b += t2 * t2 / 40320.0;
    c += t2 * t2 / 120960.0;
  }
  return 0.5 * Q + a * (P * Q + Q * P + P * Q * P) + b * (P * P * Q + Q * P * P - 3.0 * P * Q * P) +
         c * (P * Q * P * P + P * P * Q * P);
}

}  // namespace

Eigen::Matrix4d Pose3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = R();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

Pose3 ExpSe3(const Vector6d& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  return Pose3(ExpSo3(phi), RightJacobianSo3(-phi) * xi.head<3>());
}

Vector6d LogSe3(const Pose3& pose) {
  const Eigen::Vector3d phi = LogSo3(pose.rotation());
  Vector6d xi;
  xi << RightJacobianInverseSo3(-phi) * pose.translation(), phi;
  return xi;
}

Matrix6d AdjointSe3(const Pose3& pose) {
  const Eigen::Matrix3d R = pose.R();
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = R;
  adjoint.bottomRightCorner<3, 3>() = R;
  adjoint.topRightCorner<3, 3>() = Hat(pose.translation()) * R;
  return adjoint;
}

Matrix6d RightJacobianSe3(const Vector6d& xi) {
  const Eigen::Vector3d rho = -xi.head<3>(), phi = -xi.tail<3>();  // Jr(xi) = Jl(-xi)
  const Eigen::Matrix3d J = RightJacobianSo3(-phi);
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = J;
  jacobian.bottomRightCorner<3, 3>() = J;
  jacobian.topRightCorner<3, 3>() = LeftJacobianCoupling(rho, phi);
  return jacobian;
}

Matrix6d RightJacobianInverseSe3(const Vector6d& xi) {
  const Eigen::Vector3d rho = -xi.head<3>(), phi = -xi.tail<3>();
  const Eigen::Matrix3d J_inverse = RightJacobianInverseSo3(-phi);
  Matrix6d inverse = Matrix6d::Zero();
  inverse.topLeftCorner<3, 3>() = J_inverse;
  inverse.bottomRightCorner<3, 3>() = J_inverse;
  inverse.topRightCorner<3, 3>() = -J_inverse * LeftJacobianCoupling(rho, phi) * J_inverse;
  return inverse;
}

Pose3 Interpolate(const Pose3& a, const Pose3& b, double alpha) {
  return Pose3(InterpolateSo3(a.rotation(), b.rotation(), alpha),
               (1.0 - alpha) * a.translation() + alpha * b.translation());
}

Pose3 BoxPlus(const Pose3& pose, const Vector6d& delta) {
  return Pose3(pose.rotation() * ExpSo3(delta.tail<3>()),
               pose.translation() + pose.rotation() * delta.head<3>());
}

Vector6d BoxMinus(const Pose3& a, const Pose3& b) {
  const Eigen::Quaterniond inverse = b.rotation().conjugate();
  Vector6d delta;
  delta << inverse * (a.translation() - b.translation()), LogSo3(inverse * a.rotation());
  return delta;
}

}  // namespace mlvi

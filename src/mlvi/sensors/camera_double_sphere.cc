// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/camera_double_sphere.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

constexpr double kLargestRadius = 1000.0;
constexpr ErrorKind kKind = ErrorKind::kConfiguration;

}  // namespace

Expected<void> DoubleSphereCamera::ValidateShape(const Eigen::VectorXd& shape) {
  if (!(std::abs(shape[0]) < 1.0)) {
    return MakeError(kKind, "camera model double_sphere: xi = {}: must be in (-1, 1)", shape[0]);
  }
  if (!(shape[1] >= 0.0 && shape[1] <= 1.0)) {
    return MakeError(kKind, "camera model double_sphere: alpha = {}: must be in [0, 1]", shape[1]);
  }
  return {};
}

DoubleSphereCamera::DoubleSphereCamera(int width, int height, const Eigen::VectorXd& parameters)
    : CameraModel(width, height, parameters), xi_(shape()[0]), alpha_(shape()[1]) {
  const double w = alpha_ <= 0.5 ? alpha_ / (1.0 - alpha_) : (1.0 - alpha_) / alpha_;
  min_cosine_ = -w;
  const double q = 1.0 - w * w;
  const double cosine = -xi_ * q - w * std::sqrt(1.0 - xi_ * xi_ * q);
  set_max_angle(std::acos(std::clamp(cosine, -1.0, 1.0)));
}

bool DoubleSphereCamera::Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m,
                                 PointJacobian* d_point, ParameterJacobian* d_shape) const {
  const double d1 = point.norm();
  const double z2 = xi_ * d1 + point.z();
  const double d2 = std::sqrt(point.head<2>().squaredNorm() + z2 * z2);
  if (!(z2 >= min_cosine_ * d2) || d1 == 0.0) return false;
  const double denominator = alpha_ * d2 + (1.0 - alpha_) * z2;
  m = point.head<2>() / denominator;
  // Where alpha <= 0.5 the limit is at infinity: keep to what double precision resolves.
  if (!(denominator > 0.0) || m.norm() > kLargestRadius) return false;
  if (d_point != nullptr) {
    const Eigen::RowVector3d d_z2 = xi_ / d1 * point.transpose() + Eigen::RowVector3d::UnitZ();
    const Eigen::RowVector3d d_d2 =
        (Eigen::RowVector3d(point.x(), point.y(), 0.0) + z2 * d_z2) / d2;
    *d_point = -m / denominator * (alpha_ * d_d2 + (1.0 - alpha_) * d_z2);
    d_point->leftCols<2>() += Eigen::Matrix2d::Identity() / denominator;
  }
  if (d_shape != nullptr) {
    d_shape->col(0) = -m / denominator * (alpha_ * z2 / d2 + 1.0 - alpha_) * d1;
    d_shape->col(1) = -m / denominator * (d2 - z2);
  }
  return true;
}

bool DoubleSphereCamera::Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const {
  const double r2 = m.squaredNorm();
  const double root = 1.0 - (2.0 * alpha_ - 1.0) * r2;
  if (root < 0.0 || r2 > kLargestRadius * kLargestRadius) return false;
  const double c = (1.0 - alpha_ * alpha_ * r2) / (alpha_ * std::sqrt(root) + 1.0 - alpha_);
  const double scale = (xi_ * c + std::sqrt(c * c + (1.0 - xi_ * xi_) * r2)) / (c * c + r2);
  bearing = Eigen::Vector3d(scale * m.x(), scale * m.y(), scale * c - xi_).normalized();
  return true;
}

}  // namespace mlvi

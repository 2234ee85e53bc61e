// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/camera_mei.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

constexpr double kLargestRadius = 1000.0;

// |n| at which the sphere projection turns over (xi > 1), or a bound of what stays finite.
double SphereRadius(double xi) {
  return xi > 1.0 ? std::min(kLargestRadius, 1.0 / std::sqrt(xi * xi - 1.0)) : kLargestRadius;
}

// s_z + xi of the point on the sphere that n belongs to. Rounding at the turn-over is cut off.
double SphereDepth(double xi, double n2) {
  return (xi + std::sqrt(std::max(0.0, 1.0 + (1.0 - xi * xi) * n2))) / (1.0 + n2);
}

}  // namespace

Expected<void> MeiCamera::ValidateShape(const Eigen::VectorXd& shape) {
  if (shape[0] >= 0.0) return {};
  return MakeError(ErrorKind::kConfiguration, "camera model mei: xi = {}: must be >= 0", shape[0]);
}

MeiCamera::MeiCamera(int width, int height, const Eigen::VectorXd& parameters)
    : CameraModel(width, height, parameters),
      xi_(shape()[0]),
      distortion_(shape().tail<4>(), SphereRadius(xi_)) {
  const double n = distortion_.max_radius();
  set_max_angle(std::acos(std::clamp(SphereDepth(xi_, n * n) - xi_, -1.0, 1.0)));
}

bool MeiCamera::Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
                        ParameterJacobian* d_shape) const {
  const double d = point.norm();
  const Eigen::Vector3d s = point / d;
  const double denominator = s.z() + xi_;
  // Beyond the turn-over the sphere projects to valid radii again, so the radius alone does not
  // tell.
  if (!(denominator > 0.0) || (xi_ > 1.0 && s.z() * xi_ < -1.0)) return false;
  const Eigen::Vector2d n = s.head<2>() / denominator;
  Eigen::Matrix2d d_n;
  if (!distortion_.Distort(n, m, &d_n)) return false;
  if (d_point != nullptr) {
    PointJacobian n_of_s;
    n_of_s << Eigen::Matrix2d::Identity() / denominator, -n / denominator;
    *d_point = d_n * n_of_s * (Eigen::Matrix3d::Identity() - s * s.transpose()) / d;
  }
  if (d_shape != nullptr) {
    d_shape->col(0) = -(d_n * n) / denominator;
    distortion_.CoefficientJacobian(n, 1, *d_shape);
  }
  return true;
}

bool MeiCamera::Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const {
  Eigen::Vector2d n;
  if (!distortion_.Undistort(m, n)) return false;
  const double depth = SphereDepth(xi_, n.squaredNorm());
  bearing = Eigen::Vector3d(depth * n.x(), depth * n.y(), depth - xi_).normalized();
  return true;
}

}  // namespace mlvi

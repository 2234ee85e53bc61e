// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/camera_pinhole_radtan.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

const double kLargestRadius = std::tan(89.0 / 180.0 * std::numbers::pi);

}  // namespace

PinholeRadtanCamera::PinholeRadtanCamera(int width, int height, const Eigen::VectorXd& parameters)
    : CameraModel(width, height, parameters), distortion_(shape(), kLargestRadius) {
  set_max_angle(std::atan(distortion_.max_radius()));
}

bool PinholeRadtanCamera::Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m,
                                  PointJacobian* d_point, ParameterJacobian* d_shape) const {
  if (!(point.z() > 0.0)) return false;
  const Eigen::Vector2d plane = point.head<2>() / point.z();
  Eigen::Matrix2d d_plane;
  if (!distortion_.Distort(plane, m, &d_plane)) return false;
  if (d_point != nullptr) {
    d_point->leftCols<2>() = d_plane / point.z();
    d_point->col(2) = -(d_plane * plane) / point.z();
  }
  if (d_shape != nullptr) distortion_.CoefficientJacobian(plane, 0, *d_shape);
  return true;
}

bool PinholeRadtanCamera::Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const {
  Eigen::Vector2d plane;
  if (!distortion_.Undistort(m, plane)) return false;
  bearing = plane.homogeneous().normalized();
  return true;
}

}  // namespace mlvi

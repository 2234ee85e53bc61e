// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/radtan_distortion.h"

#include <Eigen/LU>
#include <cmath>

#include "mlvi/geometry/polynomial.h"

namespace mlvi {
namespace {

constexpr int kMaxIterations = 50;
constexpr int kRadialIterations = 60;
// Largest residual of the inversion, in units of the image plane (about 1e-9 px).
constexpr double kTolerance = 1e-12;

}  // namespace

RadtanDistortion::RadtanDistortion(const Eigen::VectorXd& c, double largest_radius)
    : k1_(c[0]),
      k2_(c[1]),
      p1_(c[2]),
      p2_(c[3]),
      k3_(c.size() > 4 ? c[4] : 0.0),
      count_(static_cast<int>(c.size())) {
  // d(r L)/dr as a polynomial of r^2.
  const std::vector<double> turns =
      SignChanges({1.0, 3.0 * k1_, 5.0 * k2_, 7.0 * k3_}, 0.0, largest_radius * largest_radius);
  max_radius_ = turns.empty() ? largest_radius : std::sqrt(turns.front());
}

void RadtanDistortion::Evaluate(const Eigen::Vector2d& point, Eigen::Vector2d& distorted,
                                Eigen::Matrix2d& d_point) const {
  const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
  const double scale = RadialScale(r2);
  distorted << x * scale + 2.0 * p1_ * x * y + p2_ * (r2 + 2.0 * x * x),
      y * scale + 2.0 * p2_ * x * y + p1_ * (r2 + 2.0 * y * y);
  const double d_scale = 2.0 * (k1_ + r2 * (2.0 * k2_ + r2 * 3.0 * k3_));  // dL/dx = d_scale x
  const double mixed = d_scale * x * y + 2.0 * p1_ * x + 2.0 * p2_ * y;
  d_point << scale + d_scale * x * x + 2.0 * p1_ * y + 6.0 * p2_ * x, mixed, mixed,
      scale + d_scale * y * y + 2.0 * p2_ * x + 6.0 * p1_ * y;
}

bool RadtanDistortion::Distort(const Eigen::Vector2d& point, Eigen::Vector2d& distorted,
                               Eigen::Matrix2d* d_point) const {
  if (!(point.norm() <= max_radius_)) return false;
  Eigen::Matrix2d jacobian;
  Evaluate(point, distorted, jacobian);
  if (d_point != nullptr) *d_point = jacobian;
  return jacobian.determinant() > 0.0;
}

double RadtanDistortion::InvertRadial(double distorted_radius) const {
  double low = 0.0, high = max_radius_;
  for (int i = 0; i < kRadialIterations; ++i) {
    const double middle = 0.5 * (low + high);
    (middle * RadialScale(middle * middle) < distorted_radius ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

bool RadtanDistortion::Undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& point) const {
  const double radius = distorted.norm();
  // The tangential part is a small correction of the radial one, from which Newton starts.
  point = radius > 0.0 ? Eigen::Vector2d(InvertRadial(radius) / radius * distorted) : distorted;
  Eigen::Vector2d value;
  Eigen::Matrix2d jacobian;
  for (int i = 0; i < kMaxIterations; ++i) {
    Evaluate(point, value, jacobian);
    const Eigen::Vector2d residual = value - distorted;
    if (residual.norm() <= 1e-16 * (1.0 + radius) || jacobian.determinant() <= 0.0) break;
    const Eigen::Vector2d step = jacobian.inverse() * residual;
    point -= step;
    if (step.norm() <= 1e-16 * (1.0 + point.norm())) break;
  }
  return Distort(point, value, nullptr) &&
         (value - distorted).norm() <= kTolerance * (1.0 + radius);
}

void RadtanDistortion::CoefficientJacobian(const Eigen::Vector2d& point, int column,
                                           CameraModel::ParameterJacobian& jacobian) const {
  const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
  jacobian.col(column) = r2 * point;
  jacobian.col(column + 1) = r2 * r2 * point;
  jacobian.col(column + 2) << 2.0 * x * y, r2 + 2.0 * y * y;
  jacobian.col(column + 3) << r2 + 2.0 * x * x, 2.0 * x * y;
  if (count_ > 4) jacobian.col(column + 4) = r2 * r2 * r2 * point;
}

}  // namespace mlvi

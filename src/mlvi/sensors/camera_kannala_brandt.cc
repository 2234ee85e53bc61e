// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/camera_kannala_brandt.h"

#include <cmath>
#include <numbers>

#include "mlvi/geometry/polynomial.h"

namespace mlvi {
namespace {

// The direction straight backwards has no pixel: stop before it.
constexpr double kLargestAngle = 179.0 / 180.0 * std::numbers::pi;
// Below this ratio of rho and |z|, theta = rho / z to double precision.
constexpr double kParaxial = 1e-8;
// Rounding of theta itself, so that what Lift returns for the last pixel projects again.
constexpr double kSlack = 1e-12;
constexpr int kMaxIterations = 60;  // bisection alone needs 52

}  // namespace

KannalaBrandtCamera::KannalaBrandtCamera(int width, int height, const Eigen::VectorXd& parameters)
    : CameraModel(width, height, parameters), k_(shape()) {
  // r'(theta) as a polynomial of theta^2.
  const std::vector<double> slope = {1.0, 3.0 * k_[0], 5.0 * k_[1], 7.0 * k_[2], 9.0 * k_[3]};
  const std::vector<double> turns = SignChanges(slope, 0.0, kLargestAngle * kLargestAngle);
  set_max_angle(turns.empty() ? kLargestAngle : std::sqrt(turns.front()));
  max_radius_ = Radius(max_angle());
}

double KannalaBrandtCamera::Radius(double theta) const {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3]))));
}

double KannalaBrandtCamera::RadiusDerivative(double theta) const {
  const double t2 = theta * theta;
  return 1.0 + t2 * (3.0 * k_[0] + t2 * (5.0 * k_[1] + t2 * (7.0 * k_[2] + t2 * 9.0 * k_[3])));
}

bool KannalaBrandtCamera::Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m,
                                  PointJacobian* d_point, ParameterJacobian* d_shape) const {
  const double x = point.x(), y = point.y(), z = point.z();
  const double rho = std::hypot(x, y);
  if (rho < kParaxial * z) {
    m = point.head<2>() / z;
    if (d_point != nullptr) *d_point << 1.0 / z, 0.0, -x / (z * z), 0.0, 1.0 / z, -y / (z * z);
    return true;
  }
  const double theta = std::atan2(rho, z);
  if (!(theta <= max_angle() + kSlack) || rho == 0.0) return false;  // also for NaN
  const Eigen::Vector2d direction = point.head<2>() / rho;
  const double r = Radius(theta);
  m = r * direction;
  if (d_point != nullptr) {
    const double slope = RadiusDerivative(theta) / (rho * rho + z * z);
    const Eigen::Matrix2d radial = direction * direction.transpose();
    d_point->leftCols<2>() = slope * z * radial + r / rho * (Eigen::Matrix2d::Identity() - radial);
    d_point->col(2) = -slope * rho * direction;
  }
  if (d_shape != nullptr) {
    double power = theta;
    for (int i = 0; i < 4; ++i) d_shape->col(i) = (power *= theta * theta) * direction;
  }
  return true;
}

double KannalaBrandtCamera::Invert(double r) const {
  // Newton inside of a bracket: a step that leaves it becomes a bisection.
  double low = 0.0, high = max_angle();
  double theta = std::min(r, high);
  for (int i = 0; i < kMaxIterations; ++i) {
    const double error = Radius(theta) - r;
    if (error == 0.0) break;
    (error < 0.0 ? low : high) = theta;
    double next = theta - error / RadiusDerivative(theta);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == theta || high <= low) break;
    theta = next;
  }
  return theta;
}

bool KannalaBrandtCamera::Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const {
  const double r = m.norm();
  if (r > max_radius_) return false;
  if (r < kParaxial) {
    bearing = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
    return true;
  }
  const double theta = Invert(r);
  bearing << std::sin(theta) / r * m, std::cos(theta);
  return true;
}

}  // namespace mlvi

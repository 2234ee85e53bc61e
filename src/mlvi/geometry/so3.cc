// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/so3.h"

#include <cmath>

namespace mlvi {
namespace {

// Below this angle the closed forms lose digits and their series are exact to double precision.
constexpr double kSmallAngle = 1e-4;

}  // namespace

Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& omega) {
  const double angle_squared = omega.squaredNorm();
  const double angle = std::sqrt(angle_squared);
  double real = 0.0, imaginary_scale = 0.0;
  if (angle < kSmallAngle) {
    imaginary_scale = 0.5 - angle_squared / 48.0;
    real = 1.0 - angle_squared / 8.0;
  } else {
    imaginary_scale = std::sin(0.5 * angle) / angle;
    real = std::cos(0.5 * angle);
  }
  Eigen::Quaterniond q;
  q.w() = real;
  q.vec() = imaginary_scale * omega;
  return q.normalized();
}

Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double w = sign * rotation.w();
  const double norm = v.norm();
  if (norm < kSmallAngle) {
    // 2 atan(n / w) / n = 2 / w (1 - n^2 / (3 w^2))
    return (2.0 / w) * (1.0 - norm * norm / (3.0 * w * w)) * v;
  }
  return (2.0 * std::atan2(norm, w) / norm) * v;
}

Eigen::Matrix3d RightJacobianSo3(const Eigen::Vector3d& omega) {
  const double t2 = omega.squaredNorm();
  const double t = std::sqrt(t2);
  const Eigen::Matrix3d hat = Hat(omega);
  double a = 0.5 - t2 / 24.0, b = 1.0 / 6.0 - t2 / 120.0;
  if (t >= kSmallAngle) {
    const double s = std::sin(0.5 * t);
    a = 2.0 * s * s / t2;  // (1 - cos t) / t^2 without cancellation
    b = (t - std::sin(t)) / (t2 * t);
  }
  return Eigen::Matrix3d::Identity() - a * hat + b * hat * hat;
}

Eigen::Matrix3d RightJacobianInverseSo3(const Eigen::Vector3d& omega) {
  const double t2 = omega.squaredNorm();
  const double t = std::sqrt(t2);
  const Eigen::Matrix3d hat = Hat(omega);
  double b = 1.0 / 12.0 + t2 / 720.0;
  if (t >= kSmallAngle) b = (1.0 - 0.5 * t / std::tan(0.5 * t)) / t2;
  return Eigen::Matrix3d::Identity() + 0.5 * hat + b * hat * hat;
}

Eigen::Quaterniond InterpolateSo3(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b,
                                  double alpha) {
  return (a * ExpSo3(alpha * LogSo3(a.conjugate() * b))).normalized();
}

}  // namespace mlvi

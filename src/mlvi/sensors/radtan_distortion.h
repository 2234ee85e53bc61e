// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Radial-tangential (Brown-Conrady) distortion of the image plane, as in OpenCV:
//   r^2 = x^2 + y^2,  L = 1 + k1 r^2 + k2 r^4 + k3 r^6
//   x' = x L + 2 p1 x y + p2 (r^2 + 2 x^2)
//   y' = y L + 2 p2 x y + p1 (r^2 + 2 y^2)
// Valid domain: r up to the first turn of r L(r), and a positive determinant of d(x', y')/d(x, y),
// so that the map is one-to-one.
#pragma once

#include <Eigen/Core>

#include "mlvi/sensors/camera_model.h"

namespace mlvi {

class RadtanDistortion {
 public:
  // k1 k2 p1 p2 [k3]. `largest_radius`: bound of the domain when the polynomial does not turn
  // before.
  RadtanDistortion(const Eigen::VectorXd& coefficients, double largest_radius);

  double max_radius() const { return max_radius_; }
  // False outside of the valid domain. `d_point` may be null.
  bool Distort(const Eigen::Vector2d& point, Eigen::Vector2d& distorted,
               Eigen::Matrix2d* d_point) const;
  // False when no point of the valid domain distorts to this one.
  bool Undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& point) const;
  // d distorted / d coefficients, in the columns from `column` on.
  void CoefficientJacobian(const Eigen::Vector2d& point, int column,
                           CameraModel::ParameterJacobian& jacobian) const;

 private:
  double RadialScale(double r2) const { return 1.0 + r2 * (k1_ + r2 * (k2_ + r2 * k3_)); }
  // The radius r with r L(r) = distorted radius, the start of Undistort.
  double InvertRadial(double distorted_radius) const;
  void Evaluate(const Eigen::Vector2d& point, Eigen::Vector2d& distorted,
                Eigen::Matrix2d& d_point) const;

  double k1_, k2_, p1_, p2_, k3_;
  int count_;
  double max_radius_;
};

}  // namespace mlvi

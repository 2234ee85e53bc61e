// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Kannala and Brandt, "A generic camera model ..." (TPAMI 2006), four terms: Kalibr's and OpenCV's
// "equidistant" or "fisheye"; camodocal calls the same numbers k2, k3, k4, k5.
//
//   rho = sqrt(x^2 + y^2),  theta = atan2(rho, z),  m = r(theta) / rho (x, y)
//   r(theta) = theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9
//
// Valid domain: theta in [0, max_angle], where max_angle is the first theta with r'(theta) = 0, or
// 179 degrees. Some real calibrations turn over within their image (M2DGR fifth_backleft: 76.9
// degrees, 585.8 px): pixels beyond have no bearing.
#pragma once

#include "mlvi/sensors/camera_model.h"

namespace mlvi {

class KannalaBrandtCamera final : public CameraModel {
 public:
  KannalaBrandtCamera(int width, int height, const Eigen::VectorXd& parameters);
  std::string_view name() const override { return "equidistant"; }
  static Expected<void> ValidateShape(const Eigen::VectorXd& /*shape*/) { return {}; }

 private:
  std::vector<std::string> shape_names() const override { return {"k1", "k2", "k3", "k4"}; }
  bool Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
               ParameterJacobian* d_shape) const override;
  bool Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const override;

  double Radius(double theta) const;
  double RadiusDerivative(double theta) const;
  // The theta in [0, max_angle] with Radius(theta) = r, for r in [0, max_radius_].
  double Invert(double r) const;

  Eigen::Vector4d k_;
  double max_radius_;
};

}  // namespace mlvi

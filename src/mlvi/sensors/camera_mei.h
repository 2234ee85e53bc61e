// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Mei and Rives, "Single view point omnidirectional camera calibration from planar grids" (ICRA
// 2007): the unified sphere model with radial-tangential distortion; Kalibr's "omni-radtan",
// camodocal's MEI.
//
//   s = p / |p|,  n = (s_x, s_y) / (s_z + xi),  m = distort(n)
//   back: s_z = (xi + sqrt(1 + (1 - xi^2) |n|^2)) / (1 + |n|^2) - xi,  (s_x, s_y) = (s_z + xi) n
//
// Valid domain: for xi > 1 the projection turns over at s_z = -1/xi (|n| = 1/sqrt(xi^2 - 1)); for
// xi <= 1 it reaches infinity at s_z = -xi, and |n| is bounded by 1000. Beside that, the domain of
// the distortion (radtan_distortion.h).
#pragma once

#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/radtan_distortion.h"

namespace mlvi {

class MeiCamera final : public CameraModel {
 public:
  MeiCamera(int width, int height, const Eigen::VectorXd& parameters);
  std::string_view name() const override { return "mei"; }
  // xi must not be negative.
  static Expected<void> ValidateShape(const Eigen::VectorXd& shape);

 private:
  std::vector<std::string> shape_names() const override { return {"xi", "k1", "k2", "p1", "p2"}; }
  bool Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
               ParameterJacobian* d_shape) const override;
  bool Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const override;

  double xi_;
  RadtanDistortion distortion_;
};

}  // namespace mlvi

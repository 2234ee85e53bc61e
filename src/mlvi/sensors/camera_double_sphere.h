// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Usenko, Demmel and Cremers, "The double sphere camera model" (3DV 2018).
//
//   d1 = |p|,  d2 = sqrt(x^2 + y^2 + (xi d1 + z)^2),  m = (x, y) / (alpha d2 + (1 - alpha) (xi d1 + z))
//   back: c = (1 - alpha^2 r^2) / (alpha sqrt(1 - (2 alpha - 1) r^2) + 1 - alpha),  r = |m|
//         bearing = (xi c + sqrt(c^2 + (1 - xi^2) r^2)) / (c^2 + r^2) (m_x, m_y, c) - (0, 0, xi)
//
// Valid domain: xi d1 + z > -w d2 with w = alpha / (1 - alpha) for alpha <= 0.5 (where the image
// plane is reached at infinity; r is bounded by 1000) and w = (1 - alpha) / alpha else (where the
// projection turns over). In terms of the angle: cos(theta) > -xi (1 - w^2) - w sqrt(1 - xi^2 (1 -
// w^2)). This is the exact limit; Eq. 45 of the paper normalises by the radius of the second sphere
// instead of the first, and rejects some valid directions.
#pragma once

#include "mlvi/sensors/camera_model.h"

namespace mlvi {

class DoubleSphereCamera final : public CameraModel {
 public:
  DoubleSphereCamera(int width, int height, const Eigen::VectorXd& parameters);
  std::string_view name() const override { return "double_sphere"; }
  // xi in (-1, 1), alpha in [0, 1].
  static Expected<void> ValidateShape(const Eigen::VectorXd& shape);

 private:
  std::vector<std::string> shape_names() const override { return {"xi", "alpha"}; }
  bool Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
               ParameterJacobian* d_shape) const override;
  bool Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const override;

  double xi_, alpha_;
  double min_cosine_;  // of the angle on the second sphere
};

}  // namespace mlvi

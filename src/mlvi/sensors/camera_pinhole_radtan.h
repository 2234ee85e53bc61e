// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Pinhole with radial-tangential distortion (OpenCV, Kalibr "pinhole-radtan"): m = distort(x / z, y
// / z). Valid domain: z > 0, an angle of at most 89 degrees, and the domain of the distortion
// (radtan_distortion.h).
#pragma once

#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/radtan_distortion.h"

namespace mlvi {

class PinholeRadtanCamera final : public CameraModel {
 public:
  PinholeRadtanCamera(int width, int height, const Eigen::VectorXd& parameters);
  std::string_view name() const override { return "pinhole_radtan"; }
  static Expected<void> ValidateShape(const Eigen::VectorXd& /*shape*/) { return {}; }

 private:
  std::vector<std::string> shape_names() const override { return {"k1", "k2", "p1", "p2", "k3"}; }
  bool Flatten(const Eigen::Vector3d& point, Eigen::Vector2d& m, PointJacobian* d_point,
               ParameterJacobian* d_shape) const override;
  bool Lift(const Eigen::Vector2d& m, Eigen::Vector3d& bearing) const override;

  RadtanDistortion distortion_;
};

}  // namespace mlvi

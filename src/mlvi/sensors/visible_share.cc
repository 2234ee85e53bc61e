// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/visible_share.h"

#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

double VisibleShare(const CameraSpec& camera) {
  const int width = camera.model->width(), height = camera.model->height();
  const Eigen::Vector2d middle = camera.model->principal_point();
  const double radius = camera.valid_radius_px;
  std::size_t visible = 0, index = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++index) {
      const bool within = radius == 0.0 || (Eigen::Vector2d(x, y) - middle).norm() <= radius;
      visible += within && (!camera.mask || camera.mask->pixels[index] != 0) ? 1 : 0;
    }
  }
  return static_cast<double>(visible) / static_cast<double>(index);
}

}  // namespace mlvi

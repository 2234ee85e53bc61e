// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "mlvi/sensors/camera_model.h"

namespace mlvi {

// The bearing of every pixel of a camera, from its exact lens model once and for all.
class CameraRays {
 public:
  explicit CameraRays(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }

  // The unit bearing of (column + dx, row + dy), with |dx|, |dy| <= 0.5, in the camera frame;
  // linear within the pixel. Zero where the lens model knows no bearing: the image stays black
  // there.
  Eigen::Vector3f Bearing(int column, int row, float dx = 0.0F, float dy = 0.0F) const;
  // Angle between neighbouring pixels, rad: the geometric mean of both directions.
  float PixelAngle(int column, int row) const;
  // How far a point moves in the image, px, whose bearing changes by `change` (small, across it);
  // where there is a bearing.
  Eigen::Vector2f ToPixels(int column, int row, const Eigen::Vector3f& change) const;

 private:
  struct Pixel {
    Eigen::Vector3f bearing = Eigen::Vector3f::Zero();
    Eigen::Vector3f dx = Eigen::Vector3f::Zero(), dy = Eigen::Vector3f::Zero();  // per pixel
    float angle = 0.0F;
  };
  const Pixel& At(int column, int row) const {
    return pixels_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(column)];
  }

  int width_;
  int height_;
  std::vector<Pixel> pixels_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_rays.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mlvi/base/parallel.h"

namespace mlvi {

CameraRays::CameraRays(const CameraModel& model)
    : width_(model.width()),
      height_(model.height()),
      pixels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
  ParallelFor(static_cast<std::size_t>(height_), 16, [&](std::size_t row) {
    for (int column = 0; column < width_; ++column) {
      CameraModel::PixelJacobian d_pixel;
      const auto bearing = model.Unproject({column, static_cast<double>(row)}, &d_pixel);
      // At the limit of a lens that turns over the derivative has no bound: no image there.
      if (!bearing || !(d_pixel.norm() < 0.1)) continue;
      Pixel& pixel =
          pixels_[row * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column)];
      pixel.bearing = bearing->cast<float>();
      pixel.dx = d_pixel.col(0).cast<float>();
      pixel.dy = d_pixel.col(1).cast<float>();
      pixel.angle = std::sqrt(pixel.dx.cross(pixel.dy).norm());
    }
  });
}

Eigen::Vector3f CameraRays::Bearing(int column, int row, float dx, float dy) const {
  const Pixel& pixel = At(column, row);
  if (dx == 0.0F && dy == 0.0F) return pixel.bearing;
  if (pixel.angle == 0.0F) return Eigen::Vector3f::Zero();
  return (pixel.bearing + dx * pixel.dx + dy * pixel.dy).normalized();
}

float CameraRays::PixelAngle(int column, int row) const { return At(column, row).angle; }

Eigen::Vector2f CameraRays::ToPixels(int column, int row, const Eigen::Vector3f& change) const {
  const Pixel& pixel = At(column, row);
  // Least squares: both derivatives lie across the bearing, but are not quite orthogonal.
  const float xx = pixel.dx.squaredNorm(), xy = pixel.dx.dot(pixel.dy), yy = pixel.dy.squaredNorm();
  const float x = pixel.dx.dot(change), y = pixel.dy.dot(change);
  return Eigen::Vector2f(yy * x - xy * y, xx * y - xy * x) / (xx * yy - xy * xy);
}

}  // namespace mlvi

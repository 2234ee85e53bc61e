// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_consistency.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

// In sigmas, for the homogeneous point [x; w] of triangulation.h.
double LargestMissOf(const Eigen::Vector4d& point, std::span<const Ray> rays) {
  double largest = 0.0;
  for (const Ray& ray : rays) {
    const Eigen::Vector3d to_point = point.head<3>() - point[3] * ray.origin;
    const double angle =
        std::atan2(ray.direction.cross(to_point).norm(), ray.direction.dot(to_point));
    largest = std::max(largest, angle / ray.sigma);
  }
  return largest;
}

}  // namespace

double LargestMiss(std::span<const Ray> rays) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) mean += ray.direction / (ray.sigma * ray.sigma);
  Eigen::Vector4d at_infinity = Eigen::Vector4d::Zero();
  at_infinity.head<3>() = mean.normalized();
  const double distant = LargestMissOf(at_infinity, rays);
  const auto point = TriangulateLinear(rays);
  return point ? std::min(distant, LargestMissOf(*point, rays)) : distant;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_arc.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

// Depths along a ray that are even steps of its direction from S.
class EpipolarArc {
 public:
  EpipolarArc(const Ray& ray, const DepthConfig& config)
      : along_(ray.origin.dot(ray.direction)),
        across_((ray.origin - along_ * ray.direction).norm()),
        far_(config.max_depth),
        step_(config.cell_angle),
        nearest_(AngleAt(config.min_depth)),
        steps_(static_cast<int>(std::ceil((nearest_ - AngleAt(far_)) / step_))) {}

  int steps() const { return steps_; }
  double Depth(int step) const {
    return step == steps_ ? far_ : across_ / std::tan(nearest_ - step_ * step) - along_;
  }
  // Where the ray leaves the ball of this radius around S.
  double DepthAtRange(double range) const {
    return std::sqrt(std::max(0.0, range * range - across_ * across_)) - along_;
  }

 private:
  double AngleAt(double depth) const { return std::atan2(across_, depth + along_); }

  double along_, across_, far_, step_, nearest_;
  int steps_;
};

// What stands before other things anywhere in a tracker's window; where that is empty, as between
// the rings of a single sweep, the point nearest to its middle.
std::optional<double> RangeAround(const SphericalDepthMap& map, const Eigen::Vector3d& direction,
                                  const DepthConfig& config) {
  if (const auto range = map.NearestRange(direction, kWindowReach)) return range;
  const auto near = map.Nearest(direction, 1, config.max_neighbor_angle);
  if (near.count == 0) return std::nullopt;
  return map.points()[static_cast<std::size_t>(near.index[0])].norm();
}

}  // namespace

std::optional<double> FirstSurface(const SphericalDepthMap& map, const Ray& ray,
                                   const DepthConfig& config) {
  const EpipolarArc arc(ray, config);
  double before = config.min_depth;
  for (int step = 0; step <= arc.steps(); ++step) {
    const double depth = arc.Depth(step);
    const Eigen::Vector3d place = ray.At(depth);
    const double range = place.norm();
    if (range < config.min_depth) continue;  // no point is there, and S has no direction
    const std::optional<double> seen = RangeAround(map, place / range, config);
    if (seen && *seen <= range) return std::min(std::max(arc.DepthAtRange(*seen), before), depth);
    before = depth;
  }
  return std::nullopt;
}

}  // namespace mlvi

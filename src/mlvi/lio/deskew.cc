// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/deskew.h"

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/imu/propagation.h"

namespace mlvi {
namespace {

constexpr std::int64_t kKnotNs = 1'000'000;
constexpr std::size_t kGrain = 8192;

using Affine = Eigen::Matrix<float, 3, 4>;

// T_end_lidar(t) at stamp + k * 1 ms, one knot beyond the last firing included.
std::vector<Affine> Knots(const LidarSweep& sweep, std::span<const NavState> trajectory,
                          const Pose3& T_body_lidar) {
  const Pose3 T_end_world = InterpolatePose(trajectory, sweep.end()).inverse();
  const std::size_t count = sweep.has_times ? sweep.span.nanoseconds() / kKnotNs + 2 : 1;
  std::vector<Affine> knots(count);
  for (std::size_t k = 0; k < count; ++k) {
    const Duration offset = sweep.has_times ? Duration::FromNanoseconds(k * kKnotNs) : sweep.span;
    const Pose3 T = T_end_world * InterpolatePose(trajectory, sweep.stamp + offset) * T_body_lidar;
    knots[k] = T.matrix().topRows<3>().cast<float>();
  }
  return knots;
}

Affine At(const std::vector<Affine>& knots, std::int32_t offset_ns) {
  const std::size_t last = knots.size() - 1;
  const std::size_t k = std::min<std::size_t>(std::max(offset_ns, 0) / kKnotNs, last);
  if (k == last) return knots[last];
  const float alpha =
      static_cast<float>(offset_ns - static_cast<std::int64_t>(k) * kKnotNs) / kKnotNs;
  return knots[k] + alpha * (knots[k + 1] - knots[k]);
}

}  // namespace

DeskewedSweep Deskew(const LidarSweep& sweep, std::span<const NavState> trajectory,
                     const LidarSpec& lidar) {
  MLVI_CHECK(!trajectory.empty(), "no trajectory to deskew {} points with", sweep.points.size());
  const std::vector<Affine> knots = Knots(sweep, trajectory, lidar.T_body_lidar);
  const float min_squared = static_cast<float>(lidar.min_range * lidar.min_range);
  const float max_squared = static_cast<float>(lidar.max_range * lidar.max_range);
  const std::size_t total = sweep.points.size();
  const std::size_t chunks = (total + kGrain - 1) / kGrain;
  std::vector<DeskewedSweep> parts(chunks);
  ParallelForChunks(total, kGrain, [&](std::size_t begin, std::size_t end) {
    DeskewedSweep& part = parts[begin / kGrain];
    part.points.reserve(end - begin);
    part.sources.reserve(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      const LidarPoint& point = sweep.points[i];
      const float squared_range = point.position.squaredNorm();
      if (!(squared_range >= min_squared && squared_range <= max_squared)) continue;
      const Affine T = At(knots, sweep.has_times ? point.offset_ns : 0);
      part.points.push_back(T.leftCols<3>() * point.position + T.col(3));
      part.sources.push_back(i);
    }
  });
  DeskewedSweep result{.stamp = sweep.end(), .points = {}, .sources = {}};
  result.points.reserve(total);
  result.sources.reserve(total);
  for (const DeskewedSweep& part : parts) {
    result.points.insert(result.points.end(), part.points.begin(), part.points.end());
    result.sources.insert(result.sources.end(), part.sources.begin(), part.sources.end());
  }
  return result;
}

}  // namespace mlvi

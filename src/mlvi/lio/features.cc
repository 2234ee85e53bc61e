// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/features.h"

#include <algorithm>

#include "mlvi/lio/curvature.h"
#include "mlvi/lio/marks.h"
#include "mlvi/spatial/voxel_filter.h"

namespace mlvi {
namespace {

using Indices = std::vector<std::size_t>;  // of points of the deskewed sweep

PointCloud Select(const PointCloud& points, const Indices& indices) {
  PointCloud selected;
  selected.reserve(indices.size());
  for (const std::size_t i : indices) selected.push_back(points[i]);
  return selected;
}

Indices Thinned(const PointCloud& points, const Indices& among, double cell) {
  Indices kept = VoxelThin(Select(points, among), cell);
  for (std::size_t& i : kept) i = among[i];
  return kept;
}

// Coarse cells for registration as long as they leave enough points (small rooms do not).
Indices Queries(const PointCloud& points, const Indices& fine, const LioConfig& config) {
  Indices coarse = Thinned(points, fine, config.query_spacing);
  return static_cast<int>(coarse.size()) < config.min_queries ? fine : coarse;
}

// How long before the last firing the points were measured, as a share of the span.
std::vector<float> Lags(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                        const Indices& indices) {
  std::vector<float> lags(indices.size(), 0.0F);
  if (!sweep.has_times || sweep.span.nanoseconds() <= 0) return lags;
  const auto span = static_cast<float>(sweep.span.nanoseconds());
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const LidarPoint& point = sweep.points[deskewed.sources[indices[k]]];
    lags[k] = std::clamp(1.0F - static_cast<float>(point.offset_ns) / span, 0.0F, 1.0F);
  }
  return lags;
}

}  // namespace

SweepFeatures ExtractFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                              const LidarSpec& lidar, const LioConfig& config) {
  SweepFeatures features;
  features.stamp = deskewed.stamp;
  Indices planes = VoxelThin(deskewed.points, config.cloud_spacing);
  features.cloud = Select(deskewed.points, planes);
  if (config.variant == LioVariant::kEdgePlane && sweep.has_rings) {
    const CurvatureFeatures found = FindEdgesAndPlanes(deskewed, sweep, lidar.range_noise);
    features.map_edges = Select(deskewed.points, found.edges);
    const Indices edges = Thinned(deskewed.points, found.edges, config.cloud_spacing);
    features.edges = Select(deskewed.points, edges);
    features.edge_lags = Lags(deskewed, sweep, edges);
    planes = Thinned(deskewed.points, found.planes, config.cloud_spacing);
  } else if (config.variant == LioVariant::kEdgePlane) {
    features.note = "no rings in the sweep: dense planes in place of edges and planes";
  }
  features.map_planes = Select(deskewed.points, planes);
  const Indices queries = Queries(deskewed.points, planes, config);
  features.planes = Select(deskewed.points, queries);
  features.plane_lags = Lags(deskewed, sweep, queries);
  return features;
}

PointCloud ExtractMarks(const DeskewedSweep& deskewed, const Eigen::Vector3d& axis,
                        const LidarSpec& lidar, const MarkConfig& config) {
  return Select(deskewed.points, FindMarks(deskewed.points, axis, lidar.range_noise, config));
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/features.h"

#include "mlvi/lio/curvature.h"
#include "mlvi/lio/marks.h"
#include "mlvi/spatial/voxel_filter.h"

namespace mlvi {
namespace {

PointCloud Select(const PointCloud& points, const std::vector<std::size_t>& indices) {
  PointCloud selected;
  selected.reserve(indices.size());
  for (const std::size_t i : indices) selected.push_back(points[i]);
  return selected;
}

// Coarse cells for registration as long as they leave enough points (small rooms do not).
PointCloud Queries(const PointCloud& fine, const LioConfig& config) {
  PointCloud coarse = VoxelThinned(fine, config.query_spacing);
  return static_cast<int>(coarse.size()) < config.min_queries ? fine : coarse;
}

}  // namespace

SweepFeatures ExtractFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                              const LidarSpec& lidar, const LioConfig& config) {
  SweepFeatures features;
  features.stamp = deskewed.stamp;
  features.cloud = VoxelThinned(deskewed.points, config.cloud_spacing);
  if (config.variant == LioVariant::kEdgePlane && sweep.has_rings) {
    const CurvatureFeatures found = FindEdgesAndPlanes(deskewed, sweep, lidar.range_noise);
    features.map_edges = Select(deskewed.points, found.edges);
    features.edges = VoxelThinned(features.map_edges, config.cloud_spacing);
    features.map_planes = VoxelThinned(Select(deskewed.points, found.planes), config.cloud_spacing);
  } else {
    features.map_planes = features.cloud;
    if (config.variant == LioVariant::kEdgePlane) {
      features.note = "no rings in the sweep: dense planes in place of edges and planes";
    }
  }
  features.planes = Queries(features.map_planes, config);
  return features;
}

PointCloud ExtractMarks(const DeskewedSweep& deskewed, const Eigen::Vector3d& axis,
                        const LidarSpec& lidar, const MarkConfig& config) {
  return Select(deskewed.points, FindMarks(deskewed.points, axis, lidar.range_noise, config));
}

}  // namespace mlvi

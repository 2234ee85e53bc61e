// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/features.h"

#include "mlvi/spatial/voxel_filter.h"

namespace mlvi {
namespace {

// Fine cells for the map; coarse ones for registration as long as they leave enough points (small rooms).
SweepFeatures DenseFeatures(const DeskewedSweep& deskewed, const LioConfig& config) {
  SweepFeatures features;
  features.stamp = deskewed.stamp;
  features.map_planes = VoxelThinned(deskewed.points, config.cloud_spacing);
  features.planes = VoxelThinned(features.map_planes, config.query_spacing);
  if (static_cast<int>(features.planes.size()) < config.min_queries) features.planes = features.map_planes;
  return features;
}

}  // namespace

SweepFeatures ExtractFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep, const LioConfig& config) {
  (void)sweep;
  return DenseFeatures(deskewed, config);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/local_map.h"

namespace mlvi {
namespace {

VoxelMapOptions OptionsOf(const LocalMapConfig& config) {
  return {.voxel_size = config.voxel_size,
          .max_points_per_voxel = config.max_points_per_voxel,
          .min_spacing = config.min_spacing};
}

PointCloud Transformed(const PointCloud& points, const Pose3& T) {
  PointCloud result;
  result.reserve(points.size());
  const Eigen::Matrix3d R = T.R();
  for (const Eigen::Vector3f& point : points) {
    result.push_back((R * point.cast<double>() + T.translation()).cast<float>());
  }
  return result;
}

}  // namespace

LocalMap::LocalMap(const LocalMapConfig& config, const MarkConfig& marks)
    : radius_(config.radius),
      planes_(OptionsOf(config)),
      edges_(OptionsOf(config)),
      marks_(marks),
      last_erase_(Eigen::Vector3d::Zero()) {}

double LocalMap::Insert(const SweepFeatures& features, const Pose3& T_world_body) {
  const std::size_t offered = features.map_planes.size() + features.map_edges.size();
  const std::size_t kept = planes_.Insert(Transformed(features.map_planes, T_world_body)) +
                           edges_.Insert(Transformed(features.map_edges, T_world_body));
  if (!features.marks.empty()) marks_.Insert(features.marks, T_world_body);
  // Erasing walks over all cells: once per tenth of the radius is enough.
  if ((T_world_body.translation() - last_erase_).norm() > 0.1 * radius_) {
    last_erase_ = T_world_body.translation();
    planes_.EraseBeyond(last_erase_.cast<float>(), radius_);
    edges_.EraseBeyond(last_erase_.cast<float>(), radius_);
    marks_.EraseBeyond(last_erase_, radius_);
  }
  return offered == 0 ? 0.0 : static_cast<double>(kept) / static_cast<double>(offered);
}

void LocalMap::Clear() {
  planes_.Clear();
  edges_.Clear();
  marks_.Clear();
}

}  // namespace mlvi

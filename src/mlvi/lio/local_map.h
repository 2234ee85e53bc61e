// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/lio/features.h"
#include "mlvi/lio/mark_map.h"
#include "mlvi/spatial/voxel_map.h"

namespace mlvi {

// The sliding window of features around the sensor, in the world frame.
class LocalMap {
 public:
  explicit LocalMap(const LocalMapConfig& config, const MarkConfig& marks = {});

  // Inserts a sweep seen from `T_world_body` and erases what is far from there. Returns the share
  // of its points that were new to the map, in [0, 1].
  double Insert(const SweepFeatures& features, const Pose3& T_world_body);
  void Clear();

  const VoxelMap& planes() const { return planes_; }
  const VoxelMap& edges() const { return edges_; }
  const MarkMap& marks() const { return marks_; }
  std::size_t size() const { return planes_.size() + edges_.size(); }

 private:
  double radius_;
  VoxelMap planes_;
  VoxelMap edges_;
  MarkMap marks_;
  Eigen::Vector3d last_erase_;
};

}  // namespace mlvi

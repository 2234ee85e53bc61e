// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "mlvi/lio/lio_config.h"
#include "mlvi/spatial/voxel_table.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// Where marks (marks.h) have been seen: sums over their points in cells of 0.25 m, world frame.
class MarkMap {
 public:
  explicit MarkMap(const MarkConfig& config) : config_(config) {}

  // The marks of one sweep.
  void Insert(const PointCloud& points, const Pose3& T_world_body);
  void EraseBeyond(const Eigen::Vector3d& centre, double radius);
  void Clear();
  std::size_t size() const { return cells_.size(); }

  // The mark that a point (world) of a sweep belongs to: its place along the axis through the mean
  // of its points. Empty where no mark has been seen often enough, or where its points lie farther
  // apart along the axis than `max_spread` (m).
  struct Mark {
    Eigen::Vector3d mean;
    double variance;  // m^2 along the axis, of the mean
  };
  std::optional<Mark> Find(const Eigen::Vector3d& point, const Eigen::Vector3d& axis,
                           double max_spread) const;

 private:
  struct Cell {
    double count = 0.0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // m^2, sum about the mean
    int sweeps = 0;
    int last_sweep = -1;
  };
  static VoxelKey KeyOf(const Eigen::Vector3d& point);
  static void Merge(const Cell& part, Cell& whole);

  MarkConfig config_;
  VoxelTable table_;
  std::vector<Cell> cells_;
  int sweep_ = 0;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/spatial/voxel_table.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// A cloud in a frame whose x runs along an axis, sorted into cubic cells.
class AxisCells {
 public:
  // `axis` is a unit vector in the frame of the cloud. Points farther from its origin than
  // `max_range` (m) belong to no cell.
  AxisCells(const PointCloud& cloud, const Eigen::Vector3d& axis, double cell_size,
            double max_range);

  std::size_t size() const { return cells_.size(); }
  double cell_size() const { return cell_size_; }
  const Eigen::Vector3i& coordinates(std::size_t cell) const { return cells_[cell]; }
  // The cell `by` steps along the axis, or -1 when it is empty.
  int Neighbor(std::size_t cell, int by) const;
  // Indices into the cloud, ascending.
  std::span<const std::uint32_t> members(std::size_t cell) const {
    return {members_.data() + begins_[cell], members_.data() + begins_[cell + 1]};
  }
  // In the frame along the axis.
  const Eigen::Vector3f& point(std::size_t index) const { return points_[index]; }

 private:
  double cell_size_;
  VoxelTable table_;
  std::vector<Eigen::Vector3i> cells_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint32_t> members_;
  std::vector<std::size_t> begins_;  // into members_, by cell, and the end
};

}  // namespace mlvi

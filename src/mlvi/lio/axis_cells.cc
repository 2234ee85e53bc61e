// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/axis_cells.h"

namespace mlvi {
namespace {

// Rows: the axis and two directions across it.
Eigen::Matrix3f FrameAlong(const Eigen::Vector3d& axis) {
  Eigen::Matrix3d R;
  R.row(0) = axis;
  R.row(1) = axis.unitOrthogonal();
  R.row(2) = axis.cross(axis.unitOrthogonal());
  return R.cast<float>();
}

VoxelKey KeyOf(const Eigen::Vector3i& cell) { return VoxelKey(cell.x(), cell.y(), cell.z()); }

}  // namespace

AxisCells::AxisCells(const PointCloud& cloud, const Eigen::Vector3d& axis, double cell_size,
                     double max_range)
    : cell_size_(cell_size), points_(cloud.size()) {
  const Eigen::Matrix3f R = FrameAlong(axis);
  const float inverse = static_cast<float>(1.0 / cell_size);
  const float squared_range = static_cast<float>(max_range * max_range);
  std::vector<int> cell_of(cloud.size(), -1);
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    points_[i] = R * cloud[i];
    if (cloud[i].squaredNorm() > squared_range) continue;
    const Eigen::Vector3f scaled = points_[i] * inverse;
    const Eigen::Vector3i cell(VoxelKey::Floor(scaled.x()), VoxelKey::Floor(scaled.y()),
                               VoxelKey::Floor(scaled.z()));
    bool inserted = false;
    cell_of[i] = table_.FindOrInsert(KeyOf(cell), static_cast<int>(cells_.size()), &inserted);
    if (inserted) {
      cells_.push_back(cell);
      counts.push_back(0);
    }
    ++counts[cell_of[i]];
  }
  begins_.assign(cells_.size() + 1, 0);
  for (std::size_t c = 0; c < cells_.size(); ++c) begins_[c + 1] = begins_[c] + counts[c];
  members_.resize(begins_.back());
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cell_of[i] >= 0) members_[next[cell_of[i]]++] = static_cast<std::uint32_t>(i);
  }
}

int AxisCells::Neighbor(std::size_t cell, int by) const {
  return table_.Find(KeyOf(cells_[cell] + Eigen::Vector3i(by, 0, 0)));
}

}  // namespace mlvi

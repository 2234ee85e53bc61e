// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/mark_map.h"

#include <algorithm>
#include <cmath>

namespace mlvi {
namespace {

constexpr double kCell = 0.25;  // m
constexpr int kMinPoints = 6;

Eigen::Vector3i CellOf(const Eigen::Vector3d& point) {
  return (point / kCell).array().floor().matrix().cast<int>();
}

}  // namespace

VoxelKey MarkMap::KeyOf(const Eigen::Vector3d& point) {
  const Eigen::Vector3i cell = CellOf(point);
  return VoxelKey(cell.x(), cell.y(), cell.z());
}

// Chan, Golub and LeVeque's pairwise update of mean and scatter.
void MarkMap::Merge(const Cell& part, Cell& whole) {
  const double count = whole.count + part.count;
  const Eigen::Vector3d d = part.mean - whole.mean;
  whole.scatter += part.scatter + whole.count * part.count / count * d * d.transpose();
  whole.mean += part.count / count * d;
  whole.count = count;
  whole.sweeps = std::max(whole.sweeps, part.sweeps);
  whole.last_sweep = std::max(whole.last_sweep, part.last_sweep);
}

void MarkMap::Insert(const PointCloud& points, const Pose3& T_world_body) {
  ++sweep_;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Vector3d world = T_world_body * p.cast<double>();
    bool inserted = false;
    const int index = table_.FindOrInsert(KeyOf(world), static_cast<int>(cells_.size()), &inserted);
    if (inserted) cells_.emplace_back();
    Cell& cell = cells_[index];
    Merge({.count = 1.0, .mean = world}, cell);
    cell.sweeps += cell.last_sweep == sweep_ ? 0 : 1;
    cell.last_sweep = sweep_;
  }
}

std::optional<MarkMap::Mark> MarkMap::Find(const Eigen::Vector3d& point,
                                           const Eigen::Vector3d& axis, double max_spread) const {
  Cell mark;
  const Eigen::Vector3i center = CellOf(point);
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dz = -1; dz <= 1; ++dz) {
        const int index = table_.Find(VoxelKey(center.x() + dx, center.y() + dy, center.z() + dz));
        if (index < 0) continue;
        const Cell& cell = cells_[index];
        const Eigen::Vector3d offset = cell.mean - point;
        const double along = axis.dot(offset);
        if (std::abs(along) > config_.search_distance) continue;
        if ((offset - along * axis).norm() > kCell) continue;
        Merge(cell, mark);
      }
    }
  }
  if (mark.count < kMinPoints || mark.sweeps < config_.min_sweeps) return std::nullopt;
  const double variance = axis.dot(mark.scatter * axis) / (mark.count - 1.0);
  if (variance > max_spread * max_spread) return std::nullopt;
  return Mark{mark.mean, variance / mark.count + config_.min_noise * config_.min_noise};
}

void MarkMap::EraseBeyond(const Eigen::Vector3d& centre, double radius) {
  std::erase_if(cells_, [&](const Cell& cell) { return (cell.mean - centre).norm() > radius; });
  table_.Clear();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    bool inserted = false;
    table_.FindOrInsert(KeyOf(cells_[i].mean), static_cast<int>(i), &inserted);
  }
}

void MarkMap::Clear() {
  cells_.clear();
  table_.Clear();
}

}  // namespace mlvi

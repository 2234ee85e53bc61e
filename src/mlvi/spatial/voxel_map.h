// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "mlvi/spatial/voxel_table.h"

namespace mlvi {

struct VoxelMapOptions {
  double voxel_size = 0.5;        // m, edge of a cell
  int max_points_per_voxel = 12;  // bound of memory and of search time
  double min_spacing =
      0.2;  // m; a point nearer than this to another one of its cell is not inserted
};

// The points found by VoxelMap::KNearest, nearest first.
struct Neighbors {
  static constexpr int kCapacity = 16;
  std::array<Eigen::Vector3f, kCapacity> points;
  std::array<float, kCapacity> squared_distances;
  int count = 0;
};

// Points of a bounded region in a hash of cubic cells: incremental insertion, exact nearest
// neighbours, erasure of what is far away. The content depends only on the sequence of calls.
class VoxelMap {
 public:
  explicit VoxelMap(const VoxelMapOptions& options = {});

  // Inserts in order, as far as spacing and capacity of the cells allow; returns the number of
  // points kept.
  std::size_t Insert(std::span<const Eigen::Vector3f> points);
  // Erases cells whose nearest corner is farther than `radius` from `center`; returns the number of
  // cells.
  std::size_t EraseBeyond(const Eigen::Vector3f& center, double radius);
  void Clear();

  // The `k` <= Neighbors::kCapacity nearest points within `max_distance` (m) of `query`: the exact
  // answer.
  void KNearest(const Eigen::Vector3f& query, int k, float max_distance, Neighbors& result) const;

  std::vector<Eigen::Vector3f> Points() const;
  std::size_t size() const { return size_; }
  std::size_t voxels() const { return table_.size(); }
  std::size_t memory_bytes() const;

 private:
  struct Cell {
    Eigen::Vector3i coordinates = Eigen::Vector3i::Zero();
    int count = 0;  // 0: the cell is free
  };

  bool InsertOne(const Eigen::Vector3f& point);
  int NewCell(const Eigen::Vector3i& coordinates);
  void SearchCell(const Eigen::Vector3i& coordinates, const Eigen::Vector3f& query, int k,
                  Neighbors& result, float& limit) const;

  VoxelMapOptions options_;
  float size_of_voxel_ = 0.0F;
  float inverse_size_ = 0.0F;
  float squared_spacing_ = 0.0F;
  VoxelTable table_;
  std::vector<Cell> cells_;
  std::vector<Eigen::Vector4f>
      points_;  // max_points_per_voxel slots per cell; the fourth component is zero
  std::vector<int> free_cells_;
  std::size_t size_ = 0;
};

}  // namespace mlvi

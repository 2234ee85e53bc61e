// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/spatial/voxel_map.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

Eigen::Vector3i CellOf(const Eigen::Vector3f& point, float inverse_size) {
  const Eigen::Vector3f scaled = point * inverse_size;
  return {VoxelKey::Floor(scaled.x()), VoxelKey::Floor(scaled.y()), VoxelKey::Floor(scaled.z())};
}

VoxelKey KeyOf(const Eigen::Vector3i& cell) { return VoxelKey(cell.x(), cell.y(), cell.z()); }

// Squared distance from a point to a cell.
float SquaredDistance(const Eigen::Vector3i& cell, float size, const Eigen::Vector3f& point) {
  const Eigen::Array3f low = cell.cast<float>().array() * size;
  const Eigen::Array3f outside =
      (low - point.array()).max(point.array() - (low + size)).max(Eigen::Array3f::Zero());
  return outside.square().sum();
}

// Keeps the k nearest in ascending order; `limit` is the squared distance that a further point must
// beat.
void Offer(const Eigen::Vector3f& point, float squared_distance, int k, Neighbors& result,
           float& limit) {
  int i = result.count < k ? result.count++ : k - 1;
  for (; i > 0 && result.squared_distances[i - 1] > squared_distance; --i) {
    result.squared_distances[i] = result.squared_distances[i - 1];
    result.points[i] = result.points[i - 1];
  }
  result.squared_distances[i] = squared_distance;
  result.points[i] = point;
  if (result.count == k) limit = std::min(limit, result.squared_distances[k - 1]);
}

}  // namespace

VoxelMap::VoxelMap(const VoxelMapOptions& options)
    : options_(options),
      size_of_voxel_(static_cast<float>(options.voxel_size)),
      inverse_size_(static_cast<float>(1.0 / options.voxel_size)),
      squared_spacing_(static_cast<float>(options.min_spacing * options.min_spacing)) {
  MLVI_CHECK(
      options.voxel_size > 0.0 && options.max_points_per_voxel > 0 && options.min_spacing >= 0.0,
      "voxel size {} m, {} points per voxel, spacing {} m", options.voxel_size,
      options.max_points_per_voxel, options.min_spacing);
}

std::size_t VoxelMap::Insert(std::span<const Eigen::Vector3f> points) {
  const std::size_t before = size_;
  for (const Eigen::Vector3f& point : points) size_ += InsertOne(point) ? 1 : 0;
  return size_ - before;
}

int VoxelMap::NewCell(const Eigen::Vector3i& coordinates) {
  const int next = free_cells_.empty() ? static_cast<int>(cells_.size()) : free_cells_.back();
  bool inserted = false;
  const int index = table_.FindOrInsert(KeyOf(coordinates), next, &inserted);
  if (!inserted) return index;
  if (!free_cells_.empty()) {
    free_cells_.pop_back();
  } else {
    cells_.emplace_back();
    points_.resize(cells_.size() * options_.max_points_per_voxel);
  }
  cells_[index] = {coordinates, 0};
  return index;
}

bool VoxelMap::InsertOne(const Eigen::Vector3f& point) {
  const int index = NewCell(CellOf(point, inverse_size_));
  Cell& cell = cells_[index];
  if (cell.count == options_.max_points_per_voxel) return false;
  Eigen::Vector4f* const stored =
      &points_[static_cast<std::size_t>(index) * options_.max_points_per_voxel];
  const Eigen::Vector4f candidate(point.x(), point.y(), point.z(), 0.0F);
  for (int i = 0; i < cell.count; ++i) {
    if ((stored[i] - candidate).squaredNorm() < squared_spacing_) return false;
  }
  stored[cell.count++] = candidate;
  return true;
}

void VoxelMap::SearchCell(const Eigen::Vector3i& coordinates, const Eigen::Vector3f& query, int k,
                          Neighbors& result, float& limit) const {
  if (SquaredDistance(coordinates, size_of_voxel_, query) > limit) return;
  const int index = table_.Find(KeyOf(coordinates));
  if (index < 0) return;
  const Eigen::Vector4f* const stored =
      &points_[static_cast<std::size_t>(index) * options_.max_points_per_voxel];
  const Eigen::Vector4f padded(query.x(), query.y(), query.z(), 0.0F);
  for (int i = 0; i < cells_[index].count; ++i) {
    const float squared_distance = (stored[i] - padded).squaredNorm();
    if (squared_distance <= limit) Offer(stored[i].head<3>(), squared_distance, k, result, limit);
  }
}

void VoxelMap::KNearest(const Eigen::Vector3f& query, int k, float max_distance,
                        Neighbors& result) const {
  MLVI_CHECK(k > 0 && k <= Neighbors::kCapacity, "k = {}", k);
  result.count = 0;
  float limit = max_distance * max_distance;
  const Eigen::Vector3i center = CellOf(query, inverse_size_);
  const Eigen::Array3f inside = query.array() - center.cast<float>().array() * size_of_voxel_;
  const float to_face =
      std::max(0.0F, std::min(inside.minCoeff(), (size_of_voxel_ - inside).minCoeff()));
  SearchCell(center, query, k, result, limit);
  // Shells of cells at growing Chebyshev distance; all points of shell r lie at least `nearest`
  // away.
  for (int r = 1;; ++r) {
    const float nearest = static_cast<float>(r - 1) * size_of_voxel_ + to_face;
    if (nearest * nearest > limit) return;
    for (int dx = -r; dx <= r; ++dx) {
      for (int dy = -r; dy <= r; ++dy) {
        const bool on_side = std::abs(dx) == r || std::abs(dy) == r;
        for (int dz = -r; dz <= r; dz += on_side ? 1 : 2 * r) {
          SearchCell(center + Eigen::Vector3i(dx, dy, dz), query, k, result, limit);
        }
      }
    }
  }
}

std::size_t VoxelMap::EraseBeyond(const Eigen::Vector3f& center, double radius) {
  const float squared_radius = static_cast<float>(radius * radius);
  std::size_t erased = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    if (cell.count == 0) continue;
    if (SquaredDistance(cell.coordinates, size_of_voxel_, center) <= squared_radius) continue;
    size_ -= cell.count;
    cell.count = 0;
    free_cells_.push_back(static_cast<int>(i));
    ++erased;
  }
  if (erased == 0) return 0;
  table_.Clear();
  bool inserted = false;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].count > 0)
      table_.FindOrInsert(KeyOf(cells_[i].coordinates), static_cast<int>(i), &inserted);
  }
  return erased;
}

void VoxelMap::Clear() {
  table_.Clear();
  cells_.clear();
  points_.clear();
  free_cells_.clear();
  size_ = 0;
}

std::vector<Eigen::Vector3f> VoxelMap::Points() const {
  std::vector<Eigen::Vector3f> points;
  points.reserve(size_);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (int j = 0; j < cells_[i].count; ++j) {
      points.push_back(points_[i * options_.max_points_per_voxel + j].head<3>());
    }
  }
  return points;
}

std::size_t VoxelMap::memory_bytes() const {
  return table_.memory_bytes() + cells_.capacity() * sizeof(Cell) +
         points_.capacity() * sizeof(Eigen::Vector4f) + free_cells_.capacity() * sizeof(int);
}

}  // namespace mlvi

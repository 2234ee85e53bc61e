// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/spatial/voxel_filter.h"

#include <limits>

#include "mlvi/base/error.h"
#include "mlvi/spatial/voxel_table.h"

namespace mlvi {
namespace {

struct Cell {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float count = 0.0F;
  float best_distance = std::numeric_limits<float>::infinity();
  std::size_t best = 0;
};

}  // namespace

std::vector<std::size_t> VoxelThin(std::span<const Eigen::Vector3f> points, double size) {
  MLVI_CHECK(size > 0.0, "cell size {} m", size);
  const float inverse_size = static_cast<float>(1.0 / size);
  VoxelTable table(points.size() / 4 + 64);
  std::vector<Cell> cells;
  std::vector<int> cell_of(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool inserted = false;
    cell_of[i] = table.FindOrInsert(VoxelKey::Of(points[i], inverse_size),
                                    static_cast<int>(cells.size()), &inserted);
    if (inserted) cells.emplace_back();
    cells[cell_of[i]].sum += points[i];
    cells[cell_of[i]].count += 1.0F;
  }
  for (Cell& cell : cells) cell.sum /= cell.count;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Cell& cell = cells[cell_of[i]];
    const float distance = (points[i] - cell.sum).squaredNorm();
    if (distance < cell.best_distance) {
      cell.best_distance = distance;
      cell.best = i;
    }
  }
  std::vector<std::size_t> kept;
  kept.reserve(cells.size());
  for (const Cell& cell : cells) kept.push_back(cell.best);
  return kept;
}

std::vector<Eigen::Vector3f> VoxelThinned(std::span<const Eigen::Vector3f> points, double size) {
  std::vector<Eigen::Vector3f> result;
  for (const std::size_t i : VoxelThin(points, size)) result.push_back(points[i]);
  return result;
}

}  // namespace mlvi

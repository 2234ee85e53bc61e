// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

// Which region each block of pixels of an image belongs to. Regions are the caller's: cells of a
// sphere that several cameras look at, tiles of one image. Blocks outside of all regions (masked,
// beyond the valid radius) hold kNone.
class RegionMap {
 public:
  static constexpr int kNone = -1;
  static constexpr int kBlock = 8;  // px, side of a block

  RegionMap() = default;
  RegionMap(int width, int height)
      : width_(width), height_(height), columns_((width + kBlock - 1) / kBlock) {
    MLVI_CHECK(width > 0 && height > 0, "image of {} x {} px", width, height);
    regions_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows()), kNone);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int columns() const { return columns_; }
  int rows() const { return (height_ + kBlock - 1) / kBlock; }
  int& At(int column, int row) { return regions_[Index(column, row)]; }
  int At(int column, int row) const { return regions_[Index(column, row)]; }
  int OfPixel(int x, int y) const { return At(x / kBlock, y / kBlock); }
  // The pixel in the middle of a block.
  Eigen::Vector2d Center(int column, int row) const {
    return {kBlock * (column + 0.5) - 0.5, kBlock * (row + 0.5) - 0.5};
  }

 private:
  std::size_t Index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int width_ = 0, height_ = 0, columns_ = 0;
  std::vector<int> regions_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mlvi {

// The unit sphere cut into cells of exactly equal area and nearly square shape: bands between
// circles of latitude, each cut into equal steps of azimuth. A band of n of the N cells has the
// height 2 n / N, so all cells have the area 4 pi / N (Archimedes). No pole is special and azimuth
// has no seam to those who ask by direction.
class EqualAreaSphere {
 public:
  // About `cells` >= 2 cells.
  explicit EqualAreaSphere(int cells);
  // Cells with the area of a square of `angle` (rad, in (0, pi]).
  static EqualAreaSphere WithCellAngle(double angle);

  int size() const { return size_; }
  double area() const;        // sr, of each cell
  double cell_angle() const;  // rad, side of the square of that area
  // The cell, in [0, size), of a direction of any length > 0.
  int CellOf(const Eigen::Vector3d& direction) const;
  // The unit direction in the middle of a cell.
  Eigen::Vector3d Center(int cell) const;

 private:
  struct Band {
    int first = 0, count = 0;
    double z_low = 0.0, z_high = 0.0;
  };
  int BandOf(double z) const;

  int size_ = 0;
  std::vector<Band> bands_;  // from z = -1 to z = 1
};

}  // namespace mlvi

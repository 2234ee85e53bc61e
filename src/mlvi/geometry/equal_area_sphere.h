// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
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
  // Calls visit(first, end) with runs of cells, each cell in one of them at most, that cover the cap
  // of `angle` (rad, > 0) around a unit direction; and a few beside it: a square about the circle.
  template <typename Visit>
  void ForEachRun(const Eigen::Vector3d& direction, double angle, const Visit& visit) const;

 private:
  struct Band {
    int first = 0, count = 0;
    double z_low = 0.0, z_high = 0.0;
  };
  int BandOf(double z) const;

  int size_ = 0;
  std::vector<Band> bands_;  // from z = -1 to z = 1
};

template <typename Visit>
void EqualAreaSphere::ForEachRun(const Eigen::Vector3d& direction, double angle,
                                 const Visit& visit) const {
  constexpr double kRounding = 1e-9, kPi = std::numbers::pi;
  const double reach = angle + kRounding;
  const double latitude = std::asin(std::clamp(direction.z(), -1.0, 1.0));
  const double south = std::max(latitude - reach, -0.5 * kPi);
  const double north = std::min(latitude + reach, 0.5 * kPi);
  // The cap's meridians touch it at sin(azimuth) = sin(angle) / cos(latitude); none do at a pole.
  const bool whole = latitude + reach >= 0.5 * kPi || latitude - reach <= -0.5 * kPi;
  const double half = whole ? 0.5 : std::asin(std::sin(reach) / std::cos(latitude)) / (2.0 * kPi);
  const double turn = std::atan2(direction.y(), direction.x()) / (2.0 * kPi) + 0.5;
  const int last = BandOf(std::sin(north));
  for (int i = BandOf(std::sin(south)); i <= last; ++i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    const int from = static_cast<int>(std::floor((turn - half) * band.count - kRounding));
    const int to = static_cast<int>(std::floor((turn + half) * band.count + kRounding));
    if (to - from + 1 >= band.count) {
      visit(band.first, band.first + band.count);
      continue;
    }
    visit(band.first + std::max(from, 0), band.first + std::min(to + 1, band.count));
    if (from < 0) visit(band.first + band.count + from, band.first + band.count);
    if (to >= band.count) visit(band.first, band.first + to + 1 - band.count);
  }
}

}  // namespace mlvi

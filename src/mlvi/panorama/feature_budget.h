// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mlvi/features/corners.h"
#include "mlvi/geometry/equal_area_sphere.h"
#include "mlvi/panorama/panorama_model.h"

namespace mlvi {

// One number of features for the whole sphere. What the cameras see of it is cut into about
// `budget` cells of equal area, each for one feature: one camera gets small cells, six cameras get
// large ones, overlaps count once, and the cost of everything that follows does not grow with the
// number of cameras. Where cells have no corner, others get a second one, a third, up to
// kPartsPerCell: corners are sought in parts, cells of a quarter of the area.
class FeatureBudget {
 public:
  static constexpr int kPartsPerCell = 4;

  // `budget` >= 1 features. Cells follow the model's cameras, masks and radius at the time of the
  // call, and are no smaller than a block of a region map.
  FeatureBudget(const PanoramaModel& model, int budget);

  int budget() const { return budget_; }
  const EqualAreaSphere& cells() const { return cells_; }
  const EqualAreaSphere& parts() const { return parts_; }
  int CellOfPart(int part) const { return cell_of_part_[static_cast<std::size_t>(part)]; }
  // The cell of a point on the sphere: that of its part, so that parts make up cells.
  int CellOf(const Eigen::Vector3d& point) const { return CellOfPart(parts_.CellOf(point)); }
  int visible_cells() const { return visible_; }
  // rad; two features nearer to each other than half a cell are one too many, and half a part where
  // a cell gets more than one.
  double min_distance() const { return 0.5 * cells_.cell_angle(); }
  double min_distance_in_cell() const { return 0.5 * parts_.cell_angle(); }
  // Parts as regions of a camera's image.
  const RegionMap& regions(int camera) const { return regions_[static_cast<std::size_t>(camera)]; }

  // One flag per part: a corner in it would be taken. `features` are points on the sphere, u_s.
  // While the budget is not used up these are all parts without a feature, else those of cells
  // without any. `cell_due` (one flag per cell) leaves out others.
  std::vector<std::uint8_t> WantedParts(std::span<const Eigen::Vector3d> features,
                                        std::span<const std::uint8_t> cell_due) const;
  // Of the corners found by all cameras (one vector each; regions are parts, judged) the best, by
  // their position_sigma, lifted: first one for every cell without a feature, none nearer to others
  // than min_distance; then, while the budget lasts, second ones, third ones, none nearer than
  // min_distance_in_cell.
  std::vector<PanoramicObservation> Select(const PanoramaModel& model,
                                           std::span<const std::vector<Corner>> corners,
                                           std::span<const Eigen::Vector3d> features) const;

 private:
  std::vector<int> CountPerCell(std::span<const Eigen::Vector3d> features) const;

  int budget_ = 0;
  EqualAreaSphere cells_, parts_;
  std::vector<int> cell_of_part_;
  std::vector<RegionMap> regions_;
  int visible_ = 0;
};

}  // namespace mlvi

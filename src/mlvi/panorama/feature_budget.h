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
// number of cameras.
class FeatureBudget {
 public:
  // `budget` >= 1 features. Cells follow the model's cameras, masks and radius at the time of the
  // call.
  FeatureBudget(const PanoramaModel& model, int budget);

  const EqualAreaSphere& cells() const { return cells_; }
  int visible_cells() const { return visible_; }
  // rad; two features nearer to each other than half a cell are one too many.
  double min_distance() const { return 0.5 * cells_.cell_angle(); }
  // Cells as regions of a camera's image.
  const RegionMap& regions(int camera) const { return regions_[static_cast<std::size_t>(camera)]; }

  // One flag per cell: no feature lies in it. `features` are points on the sphere, u_s.
  std::vector<std::uint8_t> EmptyCells(std::span<const Eigen::Vector3d> features) const;
  // Of the corners found by all cameras (one vector each; regions are cells) the strongest of every
  // cell, lifted; strongest first, none nearer to another one or to `features` than min_distance.
  std::vector<PanoramicObservation> Select(const PanoramaModel& model,
                                           std::span<const std::vector<Corner>> corners,
                                           std::span<const Eigen::Vector3d> features) const;

 private:
  EqualAreaSphere cells_;
  std::vector<RegionMap> regions_;
  int visible_ = 0;
};

}  // namespace mlvi

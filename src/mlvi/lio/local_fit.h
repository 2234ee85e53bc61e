// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "mlvi/spatial/voxel_map.h"

namespace mlvi {

// A plane or a line through the neighbours of a query, from the eigenvectors of their scatter.
struct LocalFit {
  Eigen::Vector3d centroid;
  Eigen::Matrix3d axes;  // columns: directions of growing spread; plane: column 0 is the normal
  Eigen::Vector3d variances;    // m^2 along the axes
  double point_variance = 0.0;  // m^2 of one map point off the fit
  int count = 0;
};

// Plane through all neighbours, none farther than `max_thickness` (m) from it, and spread in two
// directions. Empty otherwise. `prior_sigma` (m) is the noise that map points have anyway: it
// counts as three further observations, since the scatter of a handful of points is a poor estimate
// of their noise.
std::optional<LocalFit> FitPlane(const Neighbors& neighbors, double max_thickness,
                                 double prior_sigma);

// Line through all neighbours: axis 2 is its direction, spread at least three times as far as
// across.
std::optional<LocalFit> FitLine(const Neighbors& neighbors, double max_thickness,
                                double prior_sigma);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Edge and plane points by local curvature along each laser's ring (LOAM, Zhang and Singh 2014;
// LIO-SAM, Shan et al. 2020), with thresholds from the geometry of the window and the noise of the
// sensor in place of fixed lengths.
#pragma once

#include <cstddef>
#include <vector>

#include "mlvi/lio/deskew.h"

namespace mlvi {

// Indices into DeskewedSweep::points.
struct CurvatureFeatures {
  std::vector<std::size_t> edges;
  std::vector<std::size_t> planes;
};

// Needs a sweep with rings. With p_j the k = 5 points on either side of p_i, m their mean and L the
// mean distance of the outermost two, d = |m - p_i| is 0 on a plane and 0.42 L on a right-angled
// edge. Edge: d > 0.25 L and d > 4 sigma (at 3 sigma, 0.3 % of all plane points would outnumber the
// edges); plane: d < 0.1 L + 2 sigma, sigma = `range_noise` (m). Left out: windows with a gap in
// azimuth, the far side of a jump in range (it is not where the edge is, but where the shadow of
// the near side ends), and surfaces seen at grazing angles. At most 20 edges in each sixth of a
// ring, the sharpest first, none beside another.
CurvatureFeatures FindEdgesAndPlanes(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                                     double range_noise);

}  // namespace mlvi

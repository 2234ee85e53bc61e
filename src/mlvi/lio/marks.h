// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Marks: what interrupts the surfaces that run along an axis and is short along it, such as the
// 6 cm deep reveals of a door in a corridor. With noise of 1 to 3 cm no normal can be had of so
// narrow a surface, but its place along the axis is the mean of its points.
#pragma once

#include <vector>

#include "mlvi/lio/lio_config.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// The points of marks among `points` (sensor near the origin), by index, ascending. `axis` is a
// unit vector in the frame of the points, `range_noise` the noise of a point (m).
//
// Cubes of edge `config.cell` in which the points lie on one surface along the axis are divided
// into layers of 2.5 cm by the height above it. A wall fills its layer all along; a mark is a place
// where a layer holds points within 2.5 sigmas along the axis, and hardly any beside it, although
// layers of some height go on to either side.
std::vector<std::size_t> FindMarks(const PointCloud& points, const Eigen::Vector3d& axis,
                                   double range_noise, const MarkConfig& config);

}  // namespace mlvi

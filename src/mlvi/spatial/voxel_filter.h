// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace mlvi {

// Indices of one point per cubic cell of edge `size` (m, > 0): of the points in the cell the one
// nearest to their mean, so that a thinned cloud keeps measured points (a mean lies off the surface
// where a cell holds a corner). In the order in which cells were first met.
std::vector<std::size_t> VoxelThin(std::span<const Eigen::Vector3f> points, double size);

// The points themselves.
std::vector<Eigen::Vector3f> VoxelThinned(std::span<const Eigen::Vector3f> points, double size);

}  // namespace mlvi

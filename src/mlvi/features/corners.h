// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mlvi/features/image_pyramid.h"
#include "mlvi/features/region_map.h"

namespace mlvi {

struct CornerConfig {
  int window_px = 5;
  double min_texture = 6.0;
  void Declare(ConfigDeclaration& d);
};

struct Corner {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  int region = RegionMap::kNone;
  double texture = 0.0;  // grey values per px, root mean square along the weakest direction
};

// The strongest corner of every wanted region, by the smaller eigenvalue of the gradient matrix
// (Shi and Tomasi 1994), a local maximum of at least min_texture; in the order of regions. `wanted`
// has one flag per region. Only pixels around wanted regions are read: the cost follows what is
// missing, not the size of the image.
std::vector<Corner> DetectCorners(const ImagePyramid& pyramid, const RegionMap& regions,
                                  std::span<const std::uint8_t> wanted, const CornerConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mlvi/features/image_pyramid.h"
#include "mlvi/features/patch.h"
#include "mlvi/features/region_map.h"

namespace mlvi {

struct CornerConfig {
  int window_px = 5;
  double min_texture = 6.0;
  double max_position_sigma = 1.2;
  void Declare(ConfigDeclaration& d);
};

struct Corner {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  int region = RegionMap::kNone;
  double texture = 0.0;  // grey values per px, root mean square along the weakest direction
  // px, of the window around it (Patch::position_sigma); 0: not judged
  double position_sigma = 0.0;
};

// The strongest corner of every wanted region, by the smaller eigenvalue of the gradient matrix
// (Shi and Tomasi 1994), a local maximum of at least min_texture; in the order of regions. `wanted`
// has one flag per region. Only pixels around wanted regions are read: the cost follows what is
// missing, not the size of the image.
std::vector<Corner> DetectCorners(const ImagePyramid& pyramid, const RegionMap& regions,
                                  std::span<const std::uint8_t> wanted, const CornerConfig& config);

// Judges corners by the windows that they will be followed with: fills in their position_sigma and
// erases those above config.max_position_sigma and those too near to the image's border. Strong
// contrast makes corners of what is an edge to within noise (the rims of lamps and windows).
void JudgeCorners(const ImagePyramid& pyramid, const CornerConfig& config, const PatchConfig& patch,
                  std::vector<Corner>& corners);

}  // namespace mlvi

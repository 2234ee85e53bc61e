// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/base/config.h"

namespace mlvi {

// LiDAR depth for visual features.
struct DepthConfig {
  double interval = 0.25;
  double span = 5.0;
  double voxel_size = 0.1;
  double cell_angle = 0.006;
  double min_depth = 0.3;
  double max_depth = 60.0;
  int neighbors = 24;
  double max_neighbor_angle = 0.03;
  double max_spread_ratio = 0.15;
  double min_spread = 0.2;
  double min_incidence = 0.12;
  double range_noise = 0.02;
  double roughness = 0.02;
  void Declare(ConfigDeclaration& d);
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/base/config.h"

namespace mlvi {

// LiDAR depth for visual features.
struct DepthConfig {
  double interval = 0.25;
  double span = 2.5;
  double voxel_size = 0.03;
  double cell_angle = 0.005;
  double layer = 0.1;
  double min_depth = 0.3;
  double max_depth = 20.0;
  int neighbors = 8;
  double max_neighbor_angle = 0.03;
  double max_spread_ratio = 0.08;
  double min_spread = 0.15;
  double max_nearer = 3.0;
  double max_relative_sigma = 0.1;
  double min_incidence = 0.12;
  double range_noise = 0.02;
  double beam_noise = 0.0009;
  double incidence_noise = 0.02;
  double roughness = 0.03;
  void Declare(ConfigDeclaration& d);
};

}  // namespace mlvi

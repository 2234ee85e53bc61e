// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/base/config.h"

namespace mlvi {

enum class LioVariant : int { kEdgePlane = 0, kDensePlane = 1 };

// The local map: a sliding window of points around the sensor.
struct LocalMapConfig {
  double voxel_size = 0.5;
  double min_spacing = 0.2;
  int max_points_per_voxel = 12;
  double radius = 100.0;
  void Declare(ConfigDeclaration& d);
};

// Scan-to-map registration.
struct RegistrationConfig {
  int max_iterations = 8;
  int neighbors = 6;
  double max_neighbor_distance = 1.0;
  double max_search_distance = 3.0;
  double max_plane_thickness = 0.1;
  double robust_width = 2.0;
  double noise_inflation = 3.2;
  double min_noise_scale = 0.2;
  double max_noise_scale = 3.0;
  double min_map_noise = 0.02;
  double max_normal_sigma = 0.1;
  double step_tolerance_m = 0.001;
  double step_tolerance_rad = 1e-4;
  int min_correspondences = 50;
  void Declare(ConfigDeclaration& d);
};

// Which directions count as not observed by a registration.
struct DegeneracyConfig {
  double max_translation_sigma = 0.05;
  double max_rotation_sigma = 0.01;
  double max_noise_share = 0.5;
  double min_facing = 0.5;
  int min_facing_count = 20;
  int min_mark_points = 8;
  void Declare(ConfigDeclaration& d);
};

// What interrupts the surfaces along a weak axis (marks.h).
struct MarkConfig {
  bool enabled = true;
  double cell = 0.4;
  double max_range = 10.0;
  double search_distance = 0.1;
  double min_noise = 0.005;
  int min_sweeps = 3;
  void Declare(ConfigDeclaration& d);
};

// The first states.
struct StartConfig {
  double min_span = 1.0;
  double max_span = 4.0;
  int min_sweeps = 4;
  double max_speed = 3.0;
  double rest_distance = 0.05;
  double rest_angle = 0.02;
  void Declare(ConfigDeclaration& d);
};

// Sweeps during which the IMU was silent.
struct GapConfig {
  double rate_sigma = 1.5;
  double acceleration_sigma = 5.0;
  double max_silence = 1.0;
  int passes = 2;
  int recovery_sweeps = 15;
  void Declare(ConfigDeclaration& d);
};

struct LioConfig {
  LioVariant variant = LioVariant::kDensePlane;
  double cloud_spacing = 0.2;
  double query_spacing = 0.5;
  int min_queries = 1500;
  int min_points = 100;
  double lost_after = 3.0;
  double time_offset_sigma = 0.003;
  LocalMapConfig map;
  RegistrationConfig registration;
  DegeneracyConfig degeneracy;
  MarkConfig marks;
  StartConfig start;
  GapConfig gap;
  void Declare(ConfigDeclaration& d);
};

}  // namespace mlvi

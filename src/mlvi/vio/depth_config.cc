// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_config.h"

namespace mlvi {

void DepthConfig::Declare(ConfigDeclaration& d) {
  d.Field("interval", interval, "s",
          "Least time between two searches for depths: the map of the sphere is built for each",
          {0.0, 10.0});
  d.Field("span", span, "s", "Sweeps of this time are kept for depth", {0.0, 60.0});
  d.Field("voxel_size", voxel_size, "m", "One point is kept per cube of this size", {0.01, 2.0});
  d.Field("cell_angle", cell_angle, "rad",
          "Of the points in a cell of the sphere of this size the nearest ones are kept, as one",
          {5e-4, 0.1});
  d.Field("layer", layer, "m",
          "Points of a cell up to this behind the nearest one are the same surface", {0.0, 1.0});
  d.Field("min_depth", min_depth, "m", "Nearer points are the rig itself", {0.0, 10.0});
  d.Field("max_depth", max_depth, "m", "Farther points tell less than parallax", {1.0, 1000.0});
  d.Field("neighbors", neighbors, "", "Nearest points on the sphere that a plane is laid through",
          {3.0, 32.0});
  d.Field("max_neighbor_angle", max_neighbor_angle, "rad",
          "Farther points say nothing about a feature", {1e-3, 0.5});
  d.Field("max_spread_ratio", max_spread_ratio, "",
          "Largest distance of a neighbour from the plane along its beam, of the depth: more is an "
          "edge or blur",
          {0.0, 10.0});
  d.Field("min_spread", min_spread, "m", "Distances from the plane up to this always pass",
          {0.0, 10.0});
  d.Field("max_nearer", max_nearer, "",
          "Sigmas by which a point near the ray may lie before the plane: more is an edge in front",
          {1.0, 1000.0});
  d.Field("max_relative_sigma", max_relative_sigma, "",
          "Depths that are not known to this share of them are left to parallax", {0.001, 1.0});
  d.Field("min_incidence", min_incidence, "",
          "Sine of the smallest angle between a ray and the plane that it meets", {0.0, 1.0});
  d.Field("range_noise", range_noise, "m", "Of LiDAR ranges, one sigma", {1e-4, 1.0});
  d.Field("beam_noise", beam_noise, "rad", "Of the directions of LiDAR beams, one sigma",
          {0.0, 0.1});
  d.Field("incidence_noise", incidence_noise, "rad",
          "As if all beams were turned by this, one sigma: slanted surfaces are measured too near. "
          "Hundreds of features share that error, so it is set to twenty times its size",
          {0.0, 0.1});
  d.Field("roughness", roughness, "m", "Relief of surfaces, with errors of accumulation, one sigma",
          {0.0, 1.0});
}

}  // namespace mlvi

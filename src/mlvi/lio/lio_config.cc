// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/lio_config.h"

namespace mlvi {

void LocalMapConfig::Declare(ConfigDeclaration& d) {
  d.Field("voxel_size", voxel_size, "m",
          "Edge of a map cell: about the distance of the neighbours of a plane fit", {0.05, 5.0});
  d.Field("min_spacing", min_spacing, "m", "Smallest distance between map points of one cell",
          {0.0, 2.0});
  d.Field("max_points_per_voxel", max_points_per_voxel, "", "Bounds memory and search time",
          {1, 100});
  d.Field("radius", radius, "m", "Cells farther from the sensor are erased", {10.0, 1000.0});
  d.AtMost("min_spacing", "voxel_size", "cells hold one point each and no plane can be fitted");
}

void RegistrationConfig::Declare(ConfigDeclaration& d) {
  d.Field("max_iterations", max_iterations, "", "Associations of one registration at most",
          {1, 50});
  d.Field("neighbors", neighbors, "", "Map points of a plane or line fit", {4, 16});
  d.Field("max_neighbor_distance", max_neighbor_distance, "m",
          "Farthest neighbour of a fit when the prediction is good", {0.1, 10.0});
  d.Field("max_search_distance", max_search_distance, "m",
          "Farthest neighbour of a fit when the prediction is uncertain (after a gap)",
          {0.1, 20.0});
  d.AtMost("max_neighbor_distance", "max_search_distance",
           "fewer neighbours are found the less is known about the pose");
  d.Field("max_plane_thickness", max_plane_thickness, "m",
          "Largest distance of a neighbour from its plane", {0.01, 1.0});
  d.Field("robust_width", robust_width, "sigma",
          "Residuals beyond this lose weight (Cauchy kernel)", {0.5, 100.0});
  d.Field(
      "noise_inflation", noise_inflation, "",
      "Factor on the standard deviation of residuals for what neighbouring points have in common",
      {1.0, 100.0});
  d.Field("min_noise_scale", min_noise_scale, "",
          "Standard deviations are scaled to what the residuals show, down to this", {0.01, 1.0});
  d.Field("max_noise_scale", max_noise_scale, "",
          "Standard deviations are scaled to what the residuals show, up to this", {1.0, 100.0});
  d.Field(
      "min_map_noise", min_map_noise, "m",
      "Standard deviation that map points are supposed to have: counts as three points of a fit, "
      "and is scaled to what residuals show as all noise is",
      {0.001, 0.5});
  d.Field("max_normal_sigma", max_normal_sigma, "rad",
          "Fits whose normal is known worse than this are not used", {0.001, 1.0});
  d.Field("step_tolerance_m", step_tolerance_m, "m", "Converged when the last step is below this",
          {0.0, 0.1});
  d.Field("step_tolerance_rad", step_tolerance_rad, "rad",
          "Converged when the last step is below this", {0.0, 0.1});
  d.Field("min_correspondences", min_correspondences, "", "A registration with fewer is a failure",
          {6, 10000});
}

void DegeneracyConfig::Declare(ConfigDeclaration& d) {
  d.Field("max_translation_sigma", max_translation_sigma, "m",
          "A direction known worse than this by the measurement is left to the prior",
          {0.001, 10.0});
  d.Field("max_rotation_sigma", max_rotation_sigma, "rad",
          "An axis known worse than this by the measurement is left to the prior", {1e-4, 3.0});
  d.Field("max_noise_share", max_noise_share, "",
          "A direction is left to the prior when more than this share of its information is what "
          "noisy normals alone "
          "would feign",
          {0.05, 1.0});
  d.Field("min_facing", min_facing, "",
          "Along a direction that is otherwise left to the prior, constraints count whose normals "
          "have at least this cosine with it",
          {0.1, 1.0});
  d.Field("min_facing_count", min_facing_count, "", "Fewer such constraints are taken for bad fits",
          {1, 10000});
  d.Field("min_mark_points", min_mark_points, "", "Fewer points on marks are not used", {1, 10000});
}

void MarkConfig::Declare(ConfigDeclaration& d) {
  d.Field("enabled", enabled, "Whether marks are sought along a weak axis");
  d.Field("cell", cell, "m", "Cubes in which a surface along the axis is one plane", {0.1, 2.0});
  d.Field("max_range", max_range, "m", "Farther points lie too thinly", {1.0, 100.0});
  d.Field("search_distance", search_distance, "m",
          "Along the axis, to the mark of the map that a point belongs to", {0.02, 1.0});
  d.Field("min_noise", min_noise, "m",
          "Standard deviation of the place of a mark that the number of its points cannot undercut",
          {0.001, 0.5});
  d.Field("min_sweeps", min_sweeps, "",
          "A mark counts when so many sweeps have seen it: what moves is smeared by then",
          {1, 100});
}

void StartConfig::Declare(ConfigDeclaration& d) {
  d.Field("min_span", min_span, "s", "A moving start needs at least this time", {1.0, 30.0});
  d.Field("max_span", max_span, "s", "Older sweeps leave the window of a moving start",
          {1.5, 60.0});
  d.Field("min_sweeps", min_sweeps, "", "A moving start needs at least this many sweeps", {4, 100});
  d.Field("max_speed", max_speed, "m/s", "One sigma of the speed at the start", {0.1, 50.0});
  d.Field("rest_distance", rest_distance, "m", "At rest the registered sweeps move less than this",
          {0.0, 1.0});
  d.Field("rest_angle", rest_angle, "rad", "At rest the registered sweeps turn less than this",
          {0.0, 0.5});
  d.AtMost("min_span", "max_span", "no moving start ever comes about");
}

void GapConfig::Declare(ConfigDeclaration& d) {
  d.Field("rate_sigma", rate_sigma, "rad/s",
          "How the body may turn while neither IMU nor registration tells", {0.0, 20.0});
  d.Field("acceleration_sigma", acceleration_sigma, "m/s^2", "How it may accelerate in that time",
          {0.0, 100.0});
  d.Field("max_silence", max_silence, "s", "After a longer silence sweeps are rejected",
          {0.0, 10.0});
  d.Field("passes", passes, "",
          "Times that a sweep without IMU is deskewed and registered, each but the first by the "
          "result of the one before; "
          "more than two let errors of successive sweeps feed each other",
          {1, 20});
  d.Field("recovery_sweeps", recovery_sweeps, "",
          "So many sweeps after a silence may fit badly before they are taken for the view of a "
          "new place",
          {0, 1000});
}

void LioConfig::Declare(ConfigDeclaration& d) {
  d.Field("variant", variant, {"edge_plane", "dense_plane"}, "Features that are registered");
  d.Field("cloud_spacing", cloud_spacing, "m",
          "Cell of the thinned sweep that is inserted into the map and handed on", {0.01, 2.0});
  d.Field("query_spacing", query_spacing, "m", "Cell of the thinned sweep that is registered",
          {0.01, 5.0});
  d.Field("min_queries", min_queries, "",
          "Below this number of registered points the finer cloud is registered", {0, 100000});
  d.Field("min_points", min_points, "", "Sweeps with fewer points are rejected", {10, 100000});
  d.Field("lost_after", lost_after, "s",
          "Without a registration for this long track is lost and a new start begins", {0.1, 60.0});
  d.Field("time_offset_sigma", time_offset_sigma, "s",
          "One sigma of the LiDAR's time offset to the IMU in the rig file, which it stays within "
          "ten times of; 0 holds it",
          {0.0, 0.01});
  d.Section("map", map);
  d.Section("registration", registration);
  d.Section("degeneracy", degeneracy);
  d.Section("marks", marks);
  d.Section("start", start);
  d.Section("gap", gap);
  d.AtMost("cloud_spacing", "query_spacing",
           "registration is thinned more finely than the cloud that it takes points from");
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window_config.h"

namespace mlvi {

void WindowConfig::Declare(ConfigDeclaration& d) {
  d.Field("keyframes", keyframes, "", "Keyframes in the window", {3.0, 50.0});
  d.Field("compensation", compensation, {"none", "plane", "ray"},
          "What is done about the offset of cameras from the sphere's centre");
  d.Field("pixel_sigma", pixel_sigma, "px", "Of a tracked position, one sigma per axis",
          {0.01, 10.0});
  d.Field("pixel_drift", pixel_drift, "px",
          "By which tracks slip off what they follow from one set of images to the next, one sigma "
          "per axis; adds up with the square root of their number",
          {0.0, 10.0});
  d.Field("loss", loss, {"huber", "cauchy"}, "Robust kernel of bearings");
  d.Field("loss_scale", loss_scale, "", "Sigmas at which the kernel begins to count less",
          {0.1, 100.0});
  d.Field("extrinsics", extrinsics, {"off", "rig", "cameras"},
          "Estimate where the cameras are: all as one, or each");
  d.Field("extrinsics_rotation_sigma", extrinsics_rotation_sigma, "rad",
          "How well the rig file knows the rotation of cameras when it is not plainly wrong",
          {1e-6, 1.0});
  d.Field("extrinsics_translation_sigma", extrinsics_translation_sigma, "m",
          "How well the rig file knows the place of cameras", {1e-6, 1.0});
  d.Field("time_offset", time_offset,
          "Estimate how much later than their stamps images of each camera are taken");
  d.Field("time_offset_sigma", time_offset_sigma, "s",
          "How well stamps of images are known on the IMU's clock, when not plainly wrong",
          {1e-6, 1.0});
  d.Field("time_offset_difference_sigma", time_offset_difference_sigma, "s",
          "How well stamps of cameras are known among one another, when not plainly wrong",
          {1e-6, 1.0});
  d.Field("max_iterations", max_iterations, "", "Of the solver per set of images", {1.0, 100.0});
  d.Field("min_decrease", min_decrease, "",
          "The solver ends when a step lowers the objective by less than this (1: one sigma^2 / 2)",
          {0.0, 100.0});
  d.Field("min_depth", min_depth, "m", "Features are not nearer than this", {0.01, 10.0});
  d.Field("initial_depth", initial_depth, "m", "Of features that cannot be triangulated yet",
          {0.1, 1000.0});
  d.Field("min_parallax", min_parallax, "rad",
          "Angle between rays from which they are triangulated", {1e-4, 1.0});
  d.Field("outlier_sigmas", outlier_sigmas, "",
          "A feature with a root mean square error above is dropped", {1.0, 100.0});
  d.Field("max_relative_depth_sigma", max_relative_depth_sigma, "",
          "What a feature told stays in the prior when its inverse depth is known to this share",
          {0.001, 10.0});
  d.Field("max_bias_change", max_bias_change, "",
          "IMU samples are integrated anew when the bias has moved the rotation by this (rad), or "
          "the velocity by as many m/s",
          {1e-6, 1.0});
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/time.h"

namespace mlvi {

// One firing of one laser, in the lidar frame at that instant.
struct LidarRay {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();      // m, where the beam leaves the sensor
  Eigen::Vector3f direction = Eigen::Vector3f::UnitX();  // unit
  double origin_offset =
      0.0;  // m, what the sensor's range counts before `origin` (Ouster: the beam's circle)
  std::uint32_t firing = 0;  // index into LidarPattern::firing_offsets_ns
  std::uint16_t ring = 0;
};

// How well a LiDAR measures. Detection follows the received power: a Lambertian surface of
// reflectivity rho under incidence angle a at range r returns like rho cos(a) / r^2; half of the
// returns are lost where that equals the power of a surface of reflectivity 0.8 under normal
// incidence at `reference_range`.
struct LidarPhysics {
  double range_noise = 0.02;        // m, one sigma
  double beam_noise = 0.0002;       // rad, one sigma per axis of the beam direction
  double range_resolution = 0.001;  // m
  double min_range = 0.3;           // m
  double max_range = 100.0;         // m
  double reference_range = 100.0;   // m
  double dropout = 0.005;           // share of returns lost at random
  // An ideal sensor: what a pulse meets first returns all of it, glass and signs like anything
  // else.
  bool first_surface = false;
  bool plane_surfaces = false;  // no Material::relief: everything is as plane as its triangles
  // rad, full width at half maximum of the beam (a Gaussian, sampled at five points): things at its
  // rim mix with what lies behind. 0: a line.
  double beam_divergence = 0.0;
  double pulse_length = 0.4;  // m; echoes nearer to one another come back as one
  // A beam that meets a surface at the angle a lights a depth of r tan(a) divergence: the pulse
  // rises early, and the range comes out short by this share of half that depth (Laconte et al.,
  // Lidar Measurement Bias Estimation via Return Waveform Modelling, ICRA 2019: centimetres at
  // grazing incidence).
  double incidence_bias = 0.0;
  // m per decade of reflectivity below 0.8: weak pulses cross the threshold late (walk error).
  double walk_error = 0.0;
};

// Systematic error of a range, m: incidence and walk as above. `cosine` of the angle of incidence.
double RangeBias(const LidarPhysics& physics, double range, double cosine, double reflectivity);

// The same sensor without beam width, mirrors, relief of surfaces, systematic errors of range:
// white noise is all that is wrong with it.
LidarPhysics IdealPhysics(LidarPhysics physics);

// One sweep of a LiDAR: all rays in the order of its messages.
struct LidarPattern {
  std::string model;
  int rings = 0;
  int columns = 0;
  std::vector<std::int32_t> firing_offsets_ns =
      {};  // distinct instants after the sweep's first firing, ascending
  std::vector<LidarRay> rays = {};
  LidarPhysics physics = {};

  Duration span() const { return Duration::FromNanoseconds(firing_offsets_ns.back()); }
};

// Models: "OS0-128" (Ouster, 1024 columns at 10 Hz, organised ring by ring, seam behind), "VLP-32C"
// (Velodyne, 1808 firing cycles of 16 pairs, in firing order), "PandarXT-32" (Hesai, 2000 columns,
// lasers one after another). All turn clockwise seen from above, ten times a second. Error: an
// unknown model, with the known ones. Sources: RIGS 4.1-4.3: Ouster's sensor documentation and SDK,
// ros-drivers/velodyne, HesaiLidar_General_ROS.
Expected<LidarPattern> MakeLidarPattern(const std::string& model);

}  // namespace mlvi

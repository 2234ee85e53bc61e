// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTurnNs = 1e8;  // one turn at 10 Hz
// Assumed of all models: 16 mm short at 10 m and 60 deg with a beam of 6 mrad; 4 mm late for a
// surface of 8 %.
constexpr double kIncidenceBias = 0.3;
constexpr double kWalkError = 0.004;

Eigen::Vector3f Direction(double azimuth, double elevation) {
  return Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                         std::sin(azimuth) * std::cos(elevation), std::sin(elevation))
      .cast<float>();
}

// Beam elevations of an OS0-128, ring 0 first (highest).
constexpr std::array<double, 128> kOs0ElevationDeg = {
    45.75,  44.7,   43.93,  43.47,  42.72,  41.68,  40.94,  40.46,  39.7,   38.69,  37.95,  37.47,
    36.71,  35.72,  35,     34.51,  33.74,  32.78,  32.06,  31.56,  30.8,   29.85,  29.13,  28.62,
    27.86,  26.93,  26.23,  25.7,   24.93,  24.03,  23.33,  22.79,  22.03,  21.16,  20.46,  19.91,
    19.13,  18.3,   17.6,   17.04,  16.27,  15.45,  14.76,  14.19,  13.41,  12.62,  11.94,  11.34,
    10.55,  9.81,   9.13,   8.51,   7.71,   6.99,   6.31,   5.68,   4.87,   4.17,   3.5,    2.86,
    2.06,   1.37,   0.71,   0.04,   -0.77,  -1.43,  -2.09,  -2.77,  -3.6,   -4.23,  -4.9,   -5.6,
    -6.43,  -7.05,  -7.71,  -8.43,  -9.24,  -9.85,  -10.51, -11.28, -12.07, -12.65, -13.34, -14.1,
    -14.91, -15.48, -16.16, -16.95, -17.77, -18.32, -18.99, -19.8,  -20.62, -21.17, -21.84, -22.68,
    -23.5,  -24.02, -24.7,  -25.56, -26.39, -26.9,  -27.57, -28.46, -29.29, -29.78, -30.47, -31.36,
    -32.21, -32.68, -33.37, -34.29, -35.14, -35.6,  -36.29, -37.24, -38.11, -38.55, -39.24, -40.21,
    -41.08, -41.51, -42.23, -43.22, -44.09, -44.52, -45.24, -46.26};

// The four beam groups' azimuth offsets drift linearly from the first to the last four rings of the
// real table.
double Os0AzimuthOffsetDeg(int ring) {
  constexpr std::array<double, 4> kFirst = {11.24, 3.93, -3.29, -10.34},
                                  kLast = {10.34, 3.24, -3.98, -11.35};
  const auto group = static_cast<std::size_t>(ring % 4);
  const double alpha = (ring / 4) / 31.0;
  return (1.0 - alpha) * kFirst[group] + alpha * kLast[group];
}

// Ouster's formula: in the encoder frame, x = (r - n) cos(enc + az) cos(alt) + n cos(enc); the
// sensor frame is turned by half a turn and lies 36.18 mm lower.
LidarPattern Os0() {
  constexpr double kBeamCircle = 0.02767, kHeight = 0.03618;
  LidarPattern pattern{.model = "OS0-128", .rings = 128, .columns = 1024};
  // Max range and noise as measured on the Newer College recordings' processing (RIGS 4.1, 4.4).
  // Divergence: Ouster's data sheet (0.35 deg).
  pattern.physics = {.range_noise = 0.02,
                     .min_range = 0.3,
                     .max_range = 50.0,
                     .reference_range = 50.0,
                     .beam_divergence = 0.0061,
                     .incidence_bias = kIncidenceBias,
                     .walk_error = kWalkError};
  for (int column = 0; column < pattern.columns; ++column) {
    pattern.firing_offsets_ns.push_back(
        static_cast<std::int32_t>(std::lround(kTurnNs * column / pattern.columns)));
  }
  for (int ring = 0; ring < pattern.rings; ++ring) {
    for (int column = 0; column < pattern.columns; ++column) {
      const double encoder =
          2.0 * std::numbers::pi * (1.0 - static_cast<double>(column) / pattern.columns);
      const double turned = encoder + std::numbers::pi;
      const double azimuth = turned - kDegree * Os0AzimuthOffsetDeg(ring);
      const Eigen::Vector3d origin(kBeamCircle * std::cos(turned), kBeamCircle * std::sin(turned),
                                   kHeight);
      pattern.rays.push_back(
          {.origin = origin.cast<float>(),
           .direction =
               Direction(azimuth, kDegree * kOs0ElevationDeg[static_cast<std::size_t>(ring)]),
           .origin_offset = kBeamCircle,
           .firing = static_cast<std::uint32_t>(column),
           .ring = static_cast<std::uint16_t>(ring)});
    }
  }
  return pattern;
}

constexpr std::array<double, 32> kVlpElevationDeg = {
    -25,   -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667, -4,     -3.667, -3.333,
    -3,    -2.667,  -2.333, -2,     -1.667, -1.333, -1,     -0.667, -0.333, 0,      0.333,
    0.667, 1,       1.333,  1.667,  2.333,  3.333,  4.667,  7,      10.333, 15};
constexpr std::array<double, 32> kVlpAzimuthOffsetDeg = {
    -1.4, 1.4, -1.4, 1.4,  -1.4, 1.4, -4.2, -1.4, 1.4, 4.2, -4.2, -1.4, 1.4,  4.2, -4.2, -1.4,
    1.4,  4.2, -4.2, -1.4, 1.4,  4.2, -4.2, -1.4, 1.4, 4.2, -1.4, 1.4,  -1.4, 1.4, -1.4, 1.4};
constexpr std::array<int, 32> kVlpLaserOfRing = {0,  3,  4,  7,  8,  11, 12, 16, 15, 19, 20,
                                                 24, 23, 27, 28, 2,  31, 1,  6,  10, 5,  9,
                                                 14, 18, 13, 17, 22, 21, 26, 25, 30, 29};

// Lasers fire in pairs every 2.304 us, a cycle takes 55.296 us; the head turns on between pairs.
// The seam is behind.
LidarPattern Vlp32c() {
  constexpr double kCycleNs = 55296.0, kPairNs = 2304.0;
  LidarPattern pattern{.model = "VLP-32C", .rings = 32, .columns = 1808};
  pattern.physics = {.range_noise = 0.02,
                     .range_resolution = 0.004,
                     .min_range = 0.4,
                     .max_range = 200.0,
                     .reference_range = 200.0,
                     .beam_divergence = 0.003,  // the wider way of Velodyne's manual
                     .incidence_bias = kIncidenceBias,
                     .walk_error = kWalkError};
  std::array<std::size_t, 32> ring_of_laser{};
  for (std::size_t ring = 0; ring < 32; ++ring)
    ring_of_laser[static_cast<std::size_t>(kVlpLaserOfRing[ring])] = ring;
  for (int column = 0; column < pattern.columns; ++column) {
    for (std::size_t laser = 0; laser < 32; ++laser) {
      const double ns = column * kCycleNs + static_cast<double>(laser / 2) * kPairNs;
      if (laser % 2 == 0)
        pattern.firing_offsets_ns.push_back(static_cast<std::int32_t>(std::lround(ns)));
      const std::size_t ring = ring_of_laser[laser];
      const double azimuth = std::numbers::pi - 2.0 * std::numbers::pi * ns / kTurnNs +
                             kDegree * kVlpAzimuthOffsetDeg[ring];
      pattern.rays.push_back(
          {.direction = Direction(azimuth, kDegree * kVlpElevationDeg[ring]),
           .firing = static_cast<std::uint32_t>(pattern.firing_offsets_ns.size() - 1),
           .ring = static_cast<std::uint16_t>(ring)});
    }
  }
  return pattern;
}

// Lasers fire one after another, 1.512 us apart; azimuth counts clockwise from +y.
LidarPattern PandarXt32() {
  constexpr double kColumnNs = 50000.0, kLaserNs = 1512.0;
  LidarPattern pattern{.model = "PandarXT-32", .rings = 32, .columns = 2000};
  pattern.physics = {.range_noise = 0.01,
                     .range_resolution = 0.004,
                     .min_range = 0.05,
                     .max_range = 120.0,
                     .reference_range = 120.0,
                     .beam_divergence = 0.002,  // assumed
                     .incidence_bias = kIncidenceBias,
                     .walk_error = kWalkError};
  for (int column = 0; column < pattern.columns; ++column) {
    for (int ring = 0; ring < pattern.rings; ++ring) {
      const double ns = column * kColumnNs + ring * kLaserNs;
      const double azimuth = 0.5 * std::numbers::pi - 2.0 * std::numbers::pi * ns / kTurnNs;
      pattern.firing_offsets_ns.push_back(static_cast<std::int32_t>(std::lround(ns)));
      pattern.rays.push_back(
          {.direction = Direction(azimuth, kDegree * (15.0 - ring)),
           .firing = static_cast<std::uint32_t>(pattern.firing_offsets_ns.size() - 1),
           .ring = static_cast<std::uint16_t>(ring)});
    }
  }
  return pattern;
}

}  // namespace

double RangeBias(const LidarPhysics& physics, double range, double cosine, double reflectivity) {
  // Beyond 80 deg and below 1 % the models end.
  const double c = std::clamp(cosine, 0.174, 1.0);
  const double depth = 0.5 * physics.beam_divergence * range * std::sqrt(1.0 - c * c) / c;
  const double decades = std::log10(0.8 / std::clamp(reflectivity, 0.01, 0.8));
  return physics.walk_error * decades - physics.incidence_bias * depth;
}

LidarPhysics IdealPhysics(LidarPhysics physics) {
  physics.first_surface = physics.plane_surfaces = true;
  physics.beam_divergence = physics.incidence_bias = physics.walk_error = 0.0;
  return physics;
}

Expected<LidarPattern> MakeLidarPattern(const std::string& model) {
  if (model == "OS0-128") return Os0();
  if (model == "VLP-32C") return Vlp32c();
  if (model == "PandarXT-32") return PandarXt32();
  return MakeError(
      ErrorKind::kConfiguration,
      "lidar.model '{}' cannot be simulated; the models are OS0-128, VLP-32C, PandarXT-32", model);
}

}  // namespace mlvi

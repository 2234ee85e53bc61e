// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A room with a pillar, in closed form, and what a LiDAR sees of it.
#pragma once

#include <numbers>

#include "mlvi/base/random.h"
#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/geometry/triangulation.h"
#include "mlvi/state/estimates.h"

namespace mlvi::test {

// A room of 8 x 6 x 3 m with a square pillar 2 m in front of the origin (+x); S may be anywhere
// near the origin.
inline double RangeInRoom(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Array3d low(-4.0, -3.0, -1.2), high(4.0, 3.0, 1.8);
  const Eigen::Array3d inverse = direction.array().inverse();
  const double wall =
      ((low - origin.array()) * inverse).max((high - origin.array()) * inverse).minCoeff();
  const Eigen::Array3d a = (Eigen::Array3d(2.0, -0.3, -1.2) - origin.array()) * inverse;
  const Eigen::Array3d b = (Eigen::Array3d(2.6, 0.3, 1.8) - origin.array()) * inverse;
  const double enter = a.min(b).maxCoeff(), leave = a.max(b).minCoeff();
  return enter > 0.0 && enter < leave ? std::min(enter, wall) : wall;
}

// Rings of a LiDAR in `pose`: 0.7 degrees apart over +-45 degrees, 0.35 degrees between firings.
inline PointCloud ScanRoom(const Pose3& pose, double noise, RandomStream random) {
  PointCloud cloud;
  for (int ring = -64; ring <= 64; ++ring) {
    for (int column = 0; column < 1024; ++column) {
      const double elevation = ring * 0.7 * std::numbers::pi / 180.0,
                   azimuth = 2.0 * std::numbers::pi * column / 1024.0;
      const Eigen::Vector3d beam =
          pose.rotation() * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                            std::cos(elevation) * std::sin(azimuth),
                                            std::sin(elevation));
      const double range = RangeInRoom(pose.translation(), beam) + noise * random.Normal();
      cloud.push_back((pose.translation() + range * beam).cast<float>());
    }
  }
  return cloud;
}

// Directions that are not within a degree of an edge of the room or of the pillar, where depth
// jumps or bends.
inline bool IsOnOneSurface(const Ray& ray) {
  const double depth = RangeInRoom(ray.origin, ray.direction);
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(ray.direction);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector2d off(std::cos(std::numbers::pi / 4.0 * i),
                              std::sin(std::numbers::pi / 4.0 * i));
    for (const double angle : {0.015, 0.03}) {
      const Eigen::Vector3d near = (ray.direction + angle * (basis * off)).normalized();
      const Eigen::Vector3d opposite = (ray.direction - angle * (basis * off)).normalized();
      // On a plane inverse depths are linear in the direction.
      const double bend = 0.5 / (RangeInRoom(ray.origin, near)) +
                          0.5 / (RangeInRoom(ray.origin, opposite)) - std::cos(angle) / depth;
      if (std::abs(bend) * depth > 2e-3) return false;
    }
  }
  return true;
}

}  // namespace mlvi::test

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "mlvi/geometry/point_moments.h"

namespace mlvi {

// The line centroid + t direction that minimises the squared distances.
struct LineFit {
  Eigen::Vector3d centroid;
  Eigen::Vector3d direction;  // unit; its sign is arbitrary
  // Rising, m^2; the first two sum to the mean squared distance of the points to the line.
  Eigen::Vector3d eigenvalues;

  double Distance(const Eigen::Vector3d& point) const {
    return direction.cross(point - centroid).norm();
  }
  double linearity() const { return Linearity(eigenvalues); }
};

// Empty when the points do not determine a line: fewer than two, all in one place, or (to rounding)
// as wide as long.
std::optional<LineFit> FitLine(const PointMoments& moments);
std::optional<LineFit> FitLine(std::span<const Eigen::Vector3d> points);

}  // namespace mlvi

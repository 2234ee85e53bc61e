// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "mlvi/geometry/point_moments.h"

namespace mlvi {

// The plane normal . (p - centroid) = 0 that minimises the squared distances.
struct PlaneFit {
  Eigen::Vector3d centroid;
  Eigen::Vector3d normal;  // unit; its sign is arbitrary
  // Rising, m^2; the first is the mean squared distance of the points to the plane.
  Eigen::Vector3d eigenvalues;

  double SignedDistance(const Eigen::Vector3d& point) const { return normal.dot(point - centroid); }
  double planarity() const { return Planarity(eigenvalues); }
};

// Empty when the points do not determine a plane: fewer than three, or (to rounding) all on one
// line.
std::optional<PlaneFit> FitPlane(const PointMoments& moments);
std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A point from the rays that see it. Each ray has an origin of its own, so several cameras of a rig
// are as good as one (the generalised camera), and bearings are unit vectors, so every direction is
// as good as any other.
//
//   two rays    TriangulateMidpoint   closed form, exact without noise, minimises metric distance
//   many rays   TriangulateLinear     homogeneous least squares, exact without noise, points at
//   infinity included many rays   RefineTriangulation   maximum likelihood: bearing errors in the
//   tangent plane of the unit sphere
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace mlvi {

// The half-line origin + d direction, d > 0; `direction` of unit length. All rays of a call are in
// one frame.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double sigma = 1e-3;  // rad, one sigma of the direction along each axis of its tangent plane

  Eigen::Vector3d At(double depth) const { return origin + depth * direction; }
};

// Depths (m) along two rays of their points nearest to each other; empty when the rays are parallel
// (the angle between them is below 1e-9). Depths may be negative: that the point lies behind is for
// the caller to judge.
std::optional<Eigen::Vector2d> NearestDepths(const Ray& a, const Ray& b);

// The middle of the shortest line between two rays; empty when they are parallel or meet behind an
// origin.
std::optional<Eigen::Vector3d> TriangulateMidpoint(const Ray& a, const Ray& b);

// A homogeneous point [x; w], |[x; w]| = 1, w >= 0: x / w in m, or the direction x when w = 0.
// Minimises the sum of |B_i^T (x - w origin_i)|^2 / sigma_i^2 with B_i the tangent basis at
// direction i: algebraic, but nearly the likelihood when all origins are about equally far from the
// point. Needs two rays; empty when the solution is not unique (all rays on one line) or the point
// lies behind most of the rays.
std::optional<Eigen::Vector4d> TriangulateLinear(std::span<const Ray> rays);

struct TriangulatedPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  // m^2: the Cramer-Rao bound at the estimate
  double chi_square = 0.0;      // of all residuals; 2 n - 3 degrees of freedom
  int iterations = 0;
};

struct RefinementOptions {
  int max_iterations = 10;
  double relative_step = 1e-9;  // of the distance to the nearest origin: converged below
  double max_distance = 1e4;    // m from the first origin; a point farther away has no depth
};

// Maximum likelihood for isotropic bearing noise, by Levenberg-Marquardt from `initial`:
//   min sum |B_i^T (u_i(X) - direction_i)|^2 / sigma_i^2,   u_i(X) = (X - origin_i) / |X -
//   origin_i|.
// Empty when the point has no finite optimum in front of all rays within max_distance.
std::optional<TriangulatedPoint> RefineTriangulation(std::span<const Ray> rays,
                                                     const Eigen::Vector3d& initial,
                                                     const RefinementOptions& options = {});

// Linear, then refined. `rays` holds at least two.
std::optional<TriangulatedPoint> Triangulate(std::span<const Ray> rays,
                                             const RefinementOptions& options = {});

}  // namespace mlvi

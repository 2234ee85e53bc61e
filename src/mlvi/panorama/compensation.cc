// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/compensation.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "mlvi/geometry/symmetric_eigen.h"

namespace mlvi {
namespace {

// |n| / r of a plane below which it has no direction: a ray through S and C.
constexpr double kNoPlane = 1e-6;
// Smallest eigenvalue of the stacked planes, of the largest, below which they meet in a line.
constexpr double kPlaneRank = 1e-10;

// Eq. (3): n = SC x Su, world frame.
Eigen::Vector3d PlaneNormal(const PanoramicView& view) {
  const PanoramicObservation& o = view.observation;
  return view.T_world_pano.rotation() * o.center.cross(o.point);
}

// Eq. (4)-(7) for the first view: from P' along m to the ray C_1 u_1. In the plane with unit normal
// n_1, with the signed cross product [x, y] = n_1 . (x x y), the triangle u_1 P P' closes as
//   u_1 + mu f = u_1 + side u + k m   with  side = |u_1 P'| = lambda_P' - r,  so  k = -side [f, u]
//   / [f, m]
// where |[f, u]| = sin(alpha) and |[f, m]| = sin(alpha + gamma): Eq. (6) with the right side of the
// triangle and with the sign that places P on the ray C_1 u_1.
double CorrectionAlong(const Eigen::Vector3d& m, const PanoramicView& view,
                       const Eigen::Vector3d& normal, double depth_of_error_point) {
  const PanoramicObservation& o = view.observation;
  const Eigen::Vector3d n = normal.normalized();
  const Eigen::Vector3d f = view.T_world_pano.rotation() * o.bearing;
  const double radius = o.point.norm();
  const Eigen::Vector3d u = view.T_world_pano.rotation() * o.point / radius;
  const double side = depth_of_error_point - radius;
  return -side * n.dot(f.cross(u)) / n.dot(f.cross(m));
}

std::optional<Eigen::Vector3d> TriangulateTwoPlanes(const PanoramicView& a,
                                                    const PanoramicView& b) {
  const Ray ray_a = WorldRay(a, Compensation::kPlane), ray_b = WorldRay(b, Compensation::kPlane);
  const auto depths = NearestDepths(ray_a, ray_b);
  if (!depths || !(depths->minCoeff() > 0.0)) return std::nullopt;
  // S-rays are skew in general: P' is the middle between them, and the result approximate.
  const Eigen::Vector3d error_point = 0.5 * (ray_a.At((*depths)[0]) + ray_b.At((*depths)[1]));
  const Eigen::Vector3d n_a = PlaneNormal(a), n_b = PlaneNormal(b);
  const Eigen::Vector3d m = n_a.cross(n_b);  // Eq. (4)
  // Without two planes there is no line to move along, and less to correct.
  if (!(m.norm() > kNoPlane * a.observation.point.norm() * b.observation.point.norm())) {
    return error_point;
  }
  const Eigen::Vector3d line = m.normalized();
  const Eigen::Vector3d f_a = a.T_world_pano.rotation() * a.observation.bearing;
  if (std::abs(n_a.normalized().dot(f_a.cross(line))) < 1e-3) return error_point;
  return Eigen::Vector3d(error_point + CorrectionAlong(line, a, n_a, (*depths)[0]) * line);
}

// Eq. (8): n_i . (X - S_i) = 0 for all views, angular errors: rows divided by the distance from
// S_i.
std::optional<TriangulatedPoint> IntersectPlanes(std::span<const PanoramicView> views) {
  const Eigen::Vector3d origin = views.front().T_world_pano.translation();
  TriangulatedPoint result;
  std::vector<double> distances(views.size(), 1.0);
  constexpr int kPasses = 3;  // distances are known from the second pass on
  Eigen::Matrix3d hessian;
  for (result.iterations = 0; result.iterations < kPasses; ++result.iterations) {
    hessian.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Eigen::Vector3d normal = PlaneNormal(views[i]);
      if (normal.norm() < kNoPlane * views[i].observation.point.norm()) continue;
      const double sigma = WorldRay(views[i], Compensation::kPlane).sigma * distances[i];
      const Eigen::Vector3d row = normal.normalized() / sigma;
      hessian += row * row.transpose();
      right += row * row.dot(views[i].T_world_pano.translation() - origin);
    }
    const SymmetricEigen3 eigen = EigenOfSymmetric(hessian);
    if (!(eigen.values[0] > kPlaneRank * eigen.values[2])) return std::nullopt;
    result.point = origin + hessian.ldlt().solve(right);
    for (std::size_t i = 0; i < views.size(); ++i) {
      distances[i] = (result.point - views[i].T_world_pano.translation()).norm();
    }
  }
  result.covariance = hessian.inverse();
  for (const PanoramicView& view : views) {
    const Ray ray = WorldRay(view, Compensation::kPlane);
    const Eigen::Vector3d offset = result.point - ray.origin;
    if (!(offset.dot(ray.direction) > 0.0)) return std::nullopt;
    const Eigen::Vector3d normal = PlaneNormal(view);
    if (normal.norm() < kNoPlane * view.observation.point.norm()) continue;
    result.chi_square += std::pow(normal.normalized().dot(offset) / offset.norm() / ray.sigma, 2);
  }
  return result;
}

}  // namespace

Ray WorldRay(const PanoramicView& view, Compensation mode) {
  const PanoramicObservation& o = view.observation;
  const double sigma = view.pixel_sigma / o.resolution();
  if (mode == Compensation::kRay) {
    return {view.T_world_pano * o.center, view.T_world_pano.rotation() * o.bearing, sigma};
  }
  return {view.T_world_pano.translation(), view.T_world_pano.rotation() * o.point.normalized(),
          sigma};
}

std::optional<Eigen::Vector3d> TriangulateTwoViews(const PanoramicView& a, const PanoramicView& b,
                                                   Compensation mode) {
  if (mode == Compensation::kPlane) return TriangulateTwoPlanes(a, b);
  return TriangulateMidpoint(WorldRay(a, mode), WorldRay(b, mode));
}

std::optional<TriangulatedPoint> TriangulateViews(std::span<const PanoramicView> views,
                                                  Compensation mode) {
  MLVI_CHECK(views.size() >= 2, "{} views: a point needs two", views.size());
  if (mode == Compensation::kPlane) return IntersectPlanes(views);
  std::vector<Ray> rays;
  for (const PanoramicView& view : views) rays.push_back(WorldRay(view, mode));
  return Triangulate(rays);
}

}  // namespace mlvi

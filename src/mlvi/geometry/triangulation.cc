// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/triangulation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/geometry/tangent_basis.h"

namespace mlvi {
namespace {

// sin^2 of the angle between two rays below which they count as parallel.
constexpr double kParallel = 1e-18;
// The second smallest eigenvalue of the homogeneous system, of the largest, below which its
// solution is not unique.
constexpr double kRankTolerance = 1e-14;
// Of the homogeneous scale: points beyond 1e9 times the extent of the origins are directions.
constexpr double kInfinite = 1e-9;

struct NormalEquations {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  double cost = 0.0;       // chi-square
  double nearest = 1e300;  // m, distance to the nearest origin
  bool in_front = true;    // of all rays
};

// d u / d X = (I - u u^T) / |X - origin|.
NormalEquations Linearise(std::span<const Ray> rays, const Eigen::Vector3d& point) {
  NormalEquations n;
  for (const Ray& ray : rays) {
    const Eigen::Vector3d offset = point - ray.origin;
    const double distance = offset.norm();
    const Eigen::Vector3d u = offset / distance;
    n.in_front = n.in_front && u.dot(ray.direction) > 0.0;
    n.nearest = std::min(n.nearest, distance);
    const Eigen::Matrix<double, 2, 3> weighted =
        TangentBasis(ray.direction).transpose() / ray.sigma;
    const Eigen::Vector2d residual = weighted * u;  // B^T direction = 0
    const Eigen::Matrix<double, 2, 3> jacobian = (weighted - residual * u.transpose()) / distance;
    n.hessian += jacobian.transpose() * jacobian;
    n.gradient += jacobian.transpose() * residual;
    n.cost += residual.squaredNorm();
  }
  return n;
}

int CountInFront(std::span<const Ray> rays, const Eigen::Vector4d& homogeneous) {
  int count = 0;
  for (const Ray& ray : rays) {
    const Eigen::Vector3d offset = homogeneous.head<3>() - homogeneous[3] * ray.origin;
    if (offset.dot(ray.direction) > 0.0) ++count;
  }
  return count;
}

}  // namespace

std::optional<Eigen::Vector2d> NearestDepths(const Ray& a, const Ray& b) {
  // Normal equations of |a(d) - b(e)|^2; the cross product keeps the digits of small angles.
  const Eigen::Vector3d normal = a.direction.cross(b.direction);
  const double sine2 = normal.squaredNorm();
  if (!(sine2 > kParallel)) return std::nullopt;
  const Eigen::Vector3d baseline = b.origin - a.origin;
  return Eigen::Vector2d(baseline.cross(b.direction).dot(normal) / sine2,
                         baseline.cross(a.direction).dot(normal) / sine2);
}

std::optional<Eigen::Vector3d> TriangulateMidpoint(const Ray& a, const Ray& b) {
  const auto depths = NearestDepths(a, b);
  if (!depths || !(depths->minCoeff() > 0.0)) return std::nullopt;
  return Eigen::Vector3d(0.5 * (a.At((*depths)[0]) + b.At((*depths)[1])));
}

std::optional<Eigen::Vector4d> TriangulateLinear(std::span<const Ray> rays) {
  MLVI_CHECK(rays.size() >= 2, "{} rays: a point needs two", rays.size());
  // Relative to the first origin, in units of the extent of the origins: conditioning.
  const Eigen::Vector3d center = rays.front().origin;
  double extent = 0.0;
  for (const Ray& ray : rays) extent = std::max(extent, (ray.origin - center).norm());
  if (!(extent > 0.0)) return std::nullopt;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix<double, 2, 3> weighted =
        TangentBasis(ray.direction).transpose() / ray.sigma;
    Eigen::Matrix<double, 2, 4> row;
    row << weighted, -weighted * (ray.origin - center) / extent;
    normal += row.transpose() * row;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
  if (!(eigen.eigenvalues()[1] > kRankTolerance * eigen.eigenvalues()[3])) return std::nullopt;
  Eigen::Vector4d solution = eigen.eigenvectors().col(0);
  if (solution[3] < 0.0) solution = -solution;
  const bool infinite = solution[3] < kInfinite;
  if (infinite) solution[3] = 0.0;
  solution[3] /= extent;
  solution.head<3>() += solution[3] * center;
  const int in_front = CountInFront(rays, solution);
  if (infinite && 2 * in_front < static_cast<int>(rays.size())) {
    solution = -solution;
    solution[3] = 0.0;
  } else if (2 * in_front <= static_cast<int>(rays.size())) {
    return std::nullopt;
  }
  return Eigen::Vector4d(solution.normalized());
}

std::optional<TriangulatedPoint> RefineTriangulation(std::span<const Ray> rays,
                                                     const Eigen::Vector3d& initial,
                                                     const RefinementOptions& options) {
  MLVI_CHECK(rays.size() >= 2, "{} rays: a point needs two", rays.size());
  TriangulatedPoint result{.point = initial};
  NormalEquations current = Linearise(rays, initial);
  double damping = 1e-6;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    Eigen::Matrix3d damped = current.hessian;
    damped.diagonal() *= 1.0 + damping;
    const Eigen::Vector3d step = -damped.ldlt().solve(current.gradient);
    if (!step.allFinite()) return std::nullopt;
    const NormalEquations next = Linearise(rays, result.point + step);
    // Rounding lets the cost of a converged point rise in its last digits.
    if (next.cost <= current.cost * (1.0 + 1e-12)) {
      result.point += step;
      current = next;
      damping *= 0.1;
    } else {
      damping = std::max(damping * 10.0, 1e-3);
    }
    if (step.norm() < options.relative_step * current.nearest) break;
  }
  const bool near = (result.point - rays.front().origin).norm() < options.max_distance;
  if (!near || !current.in_front) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(current.hessian);
  if (!(ldlt.rcond() > 1e-15)) return std::nullopt;
  result.covariance = ldlt.solve(Eigen::Matrix3d::Identity());
  result.chi_square = current.cost;
  return result;
}

std::optional<TriangulatedPoint> Triangulate(std::span<const Ray> rays,
                                             const RefinementOptions& options) {
  const auto linear = TriangulateLinear(rays);
  if (!linear || !(*linear)[3] || !((*linear)[3] * options.max_distance > 1e-3)) {
    return std::nullopt;
  }
  return RefineTriangulation(rays, linear->head<3>() / (*linear)[3], options);
}

}  // namespace mlvi

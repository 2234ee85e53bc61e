// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/plane_fit.h"

#include "mlvi/geometry/symmetric_eigen.h"

namespace mlvi {
namespace {

// Of the largest eigenvalue: below it the second one is rounding, and the normal with it.
constexpr double kRankTolerance = 1e-12;

}  // namespace

std::optional<PlaneFit> FitPlane(const PointMoments& moments) {
  if (moments.count() < 3) return std::nullopt;
  const SymmetricEigen3 eigen = EigenOfSymmetric(moments.covariance());
  if (!(eigen.values[1] > kRankTolerance * eigen.values[2])) return std::nullopt;
  return PlaneFit{
      .centroid = moments.centroid(), .normal = eigen.vectors.col(0), .eigenvalues = eigen.values};
}

std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points) {
  PointMoments moments;
  for (const Eigen::Vector3d& point : points) moments.Add(point);
  return FitPlane(moments);
}

}  // namespace mlvi

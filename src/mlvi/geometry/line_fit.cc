// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/line_fit.h"

#include "mlvi/geometry/symmetric_eigen.h"

namespace mlvi {
namespace {

// Of the largest eigenvalue: what rounding alone may put between the two largest.
constexpr double kGapTolerance = 1e-12;

}  // namespace

std::optional<LineFit> FitLine(const PointMoments& moments) {
  if (moments.count() < 2) return std::nullopt;
  const SymmetricEigen3 eigen = EigenOfSymmetric(moments.covariance());
  const double gap = eigen.values[2] - eigen.values[1];
  if (!(eigen.values[2] > 0.0) || gap <= kGapTolerance * eigen.values[2]) return std::nullopt;
  return LineFit{.centroid = moments.centroid(),
                 .direction = eigen.vectors.col(2),
                 .eigenvalues = eigen.values};
}

std::optional<LineFit> FitLine(std::span<const Eigen::Vector3d> points) {
  PointMoments moments;
  for (const Eigen::Vector3d& point : points) moments.Add(point);
  return FitLine(moments);
}

}  // namespace mlvi

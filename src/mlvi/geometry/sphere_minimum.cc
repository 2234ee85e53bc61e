// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/sphere_minimum.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace mlvi {

Eigen::Vector3d MinimizeOnSphere(const Eigen::Matrix3d& H, const Eigen::Vector3d& c,
                                 double radius) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(0.5 * (H + H.transpose()));
  const Eigen::Vector3d h = eigen.eigenvalues(), d = eigen.eigenvectors().transpose() * c;
  const auto solution = [&](double lambda) -> Eigen::Vector3d {
    return d.array() / (h.array() + lambda);
  };
  // |solution| falls from at least the radius at `low` to at most the radius at `high`.
  double low = -h(0) + std::abs(d(0)) / radius, high = -h(0) + d.norm() / radius;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (solution(middle).norm() > radius ? low : high) = middle;
  }
  return radius * (eigen.eigenvectors() * solution(high)).normalized();
}

}  // namespace mlvi

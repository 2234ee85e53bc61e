// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mlvi {

// An orthonormal basis of the plane tangent to the unit sphere at `bearing` (unit): B^T B = I, B^T
// bearing = 0. Deterministic, defined for every bearing, smooth but across z = 0 (Duff et al.,
// "Building an Orthonormal Basis, Revisited", JCGT 2017: no sphere has a basis that is smooth
// everywhere).
inline Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& bearing) {
  const double sign = bearing.z() < 0.0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + bearing.z());
  const double b = bearing.x() * bearing.y() * a;
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) << 1.0 + sign * bearing.x() * bearing.x() * a, sign * b, -sign * bearing.x();
  basis.col(1) << b, sign + bearing.y() * bearing.y() * a, -bearing.y();
  return basis;
}

}  // namespace mlvi

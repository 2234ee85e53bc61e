// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mlvi {

struct SymmetricEigen3 {
  Eigen::Vector3d values;   // rising
  Eigen::Matrix3d vectors;  // one orthonormal column per value
};

// Eigenvalues and eigenvectors of a symmetric 3x3 matrix in closed form, twice as fast as
// iteration. The values are then taken as Rayleigh quotients of the vectors, so small ones keep
// their digits. Vectors of values that agree to 1e-6 of the largest are arbitrary within their
// plane.
SymmetricEigen3 EigenOfSymmetric(const Eigen::Matrix3d& matrix);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/symmetric_eigen.h"

#include <Eigen/Eigenvalues>
#include <utility>

namespace mlvi {

SymmetricEigen3 EigenOfSymmetric(const Eigen::Matrix3d& matrix) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(matrix);
  SymmetricEigen3 eigen{.values = Eigen::Vector3d::Zero(), .vectors = solver.eigenvectors()};
  for (int i = 0; i < 3; ++i) {
    eigen.values[i] = eigen.vectors.col(i).dot(matrix * eigen.vectors.col(i));
  }
  // The quotients of nearly equal values may come out in another order.
  for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}}) {
    if (eigen.values[i] <= eigen.values[j]) continue;
    std::swap(eigen.values[i], eigen.values[j]);
    eigen.vectors.col(i).swap(eigen.vectors.col(j));
  }
  return eigen;
}

}  // namespace mlvi

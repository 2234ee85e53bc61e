// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/nees.h"

#include <Eigen/Cholesky>
#include <numeric>

#include "mlvi/eval/chi_square.h"

namespace mlvi {

Expected<double> PoseNees(const Pose3& estimate, const Pose3& truth, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (!covariance.allFinite() || llt.info() != Eigen::Success) {
    return MakeError(ErrorKind::kInput,
                     "NEES: the covariance is not positive definite (diagonal {:.3g} to {:.3g})",
                     covariance.diagonal().minCoeff(), covariance.diagonal().maxCoeff());
  }
  return llt.matrixL().solve(BoxMinus(truth, estimate)).squaredNorm();
}

NeesSummary SummarizeNees(std::span<const double> values, int dof) {
  MLVI_CHECK(!values.empty() && dof > 0, "{} values of {} degrees of freedom", values.size(), dof);
  const double n = static_cast<double>(values.size());
  return {.count = values.size(),
          .dof = dof,
          .mean = std::accumulate(values.begin(), values.end(), 0.0) / n,
          .low = ChiSquareQuantile(0.025, n * dof) / n,
          .high = ChiSquareQuantile(0.975, n * dof) / n};
}

}  // namespace mlvi

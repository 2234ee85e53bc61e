// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Normalised estimation error squared: whether errors are as large as the covariance claims
// (Bar-Shalom et al. 2001, 5.4).
#pragma once

#include <Eigen/Core>
#include <span>

#include "mlvi/base/error.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// e^T P^-1 e with e = BoxMinus(truth, estimate), P in the same chart. Error (kInput) when P is not
// positive definite.
Expected<double> PoseNees(const Pose3& estimate, const Pose3& truth, const Matrix6d& covariance);

struct NeesSummary {
  std::size_t count = 0;
  int dof = 0;
  double mean = 0.0;             // expected: dof
  double low = 0.0, high = 0.0;  // 95 % band of the mean of `count` independent values
  // Below `low` the estimator is too cautious, above `high` too sure of itself. Errors of one
  // trajectory are correlated in time: thin the values, or average over runs, before taking the
  // band literally.
  bool consistent() const { return mean >= low && mean <= high; }
};

// Contract: at least one value.
NeesSummary SummarizeNees(std::span<const double> values, int dof);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>

#include <memory>
#include <span>
#include <vector>

#include "mlvi/solver/front_cholesky.h"
#include "mlvi/solver/variable_table.h"

namespace mlvi::internal {

// One factor and its linear approximation around the linearisation points of its variables:
// objective + 1/2 |A d + r|^2 - 1/2 |r|^2 for a step d. A and r take a third of the memory that the
// Hessian of a factor between two poses would, and memory is what limits both the elimination and
// the check of the approximation.
struct Factor {
  std::shared_ptr<const ceres::CostFunction> cost;  // null once removed
  std::shared_ptr<const ceres::LossFunction> loss;
  std::vector<int> variables;
  std::vector<int> start;  // tangent offset of every variable in d, and their total
  // `rows` rows [A | r], stride() numbers apart, zero behind r; weighted by the loss.
  AlignedBuffer augmented;
  int rows = 0;
  double objective = 0.0;  // at the linearisation points

  // Where the Bayes tree adds it: the clique, and per variable the coordinate in its front.
  int clique = -1;
  std::vector<int> coordinate;

  bool alive() const { return cost != nullptr; }
  int dimension() const { return start.back(); }
  int stride() const { return PadRows(dimension() + 1); }
};

// Memory for evaluating factors, kept between calls.
class FactorWorkspace {
 public:
  // Evaluates at the linearisation points and fills factor->augmented. The loss enters as a weight
  // of the residual (iteratively reweighted least squares), so A^T A is positive semidefinite.
  // False when the cost function refuses or a number is not finite; the factor is then as before.
  bool Linearize(const VariableTable& variables, Factor* factor);
  // How much the approximation errs about the objective of the factor at the estimate. Not finite
  // when the cost function refuses.
  double ModelError(const VariableTable& variables, const Factor& factor);
  // 1/2 loss(|cost|^2) at the estimate; NaN when the cost function refuses.
  double Objective(const VariableTable& variables, const Factor& factor);

 private:
  // Residual and tangent Jacobian into augmented_: rows of stride() numbers, the residual behind
  // the Jacobian.
  bool EvaluateAugmented(const VariableTable& variables, const Factor& factor);

  std::vector<const double*> parameters_;
  std::vector<double> residuals_, ambient_;
  std::vector<double*> jacobians_;
  AlignedBuffer augmented_, step_;
};

}  // namespace mlvi::internal

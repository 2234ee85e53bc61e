// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "mlvi/vio/window_linearization.h"

namespace mlvi {

struct WindowSolution {
  bool solved = false;  // false: the normal equations are not positive definite or not finite
  int iterations = 0;
  double initial_cost = 0.0, final_cost = 0.0;
  // Both of the window as it is left.
  std::vector<BearingStatistics> per_camera;
  // Linearised there, features eliminated, undamped: the information of the estimate.
  ReducedSystem information;
};

// Levenberg-Marquardt over the whole window; bounded by iterations, never by time. Results have the
// same bits at any number of threads.
WindowSolution SolveWindow(VioWindow& window, const WindowConfig& config, double gravity);

// Columns of the inverse of a symmetric positive definite matrix (upper triangle given). Scaled to
// a unit diagonal first, as units of states differ by many orders. Empty when not positive
// definite.
std::optional<Eigen::MatrixXd> InverseColumns(const Eigen::MatrixXd& upper, int first, int count);

}  // namespace mlvi

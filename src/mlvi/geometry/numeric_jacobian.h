// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Numeric differentiation, the oracle of analytic Jacobians in tests.
#pragma once

#include <Eigen/Core>

namespace mlvi {

// d f / d x at x, one column per element of x, by central differences of fourth order:
// f' = (8 (f(x+h) - f(x-h)) - (f(x+2h) - f(x-2h))) / (12 h). The error is about eps |f| / h + h^4
// |f'''''| / 30; h = 1e-3 of the scale of x gives 1e-12 relative for smooth functions.
template <typename Function, typename Vector>
Eigen::MatrixXd NumericJacobian(const Function& f, const Vector& x, double step = 1e-3) {
  const Eigen::VectorXd value = f(x);
  Eigen::MatrixXd jacobian(value.size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto at = [&](double offset) -> Eigen::VectorXd {
      Vector moved = x;
      moved[i] += offset;
      return f(moved);
    };
    jacobian.col(i) =
        (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step);
  }
  return jacobian;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace mlvi {

// c[0] + c[1] x + c[2] x^2 + ...
double EvaluatePolynomial(const std::vector<double>& coefficients, double x);

// The roots in (low, high) at which the polynomial changes its sign, in rising order. Found by
// bisection between the roots of the derivative, so none is missed however close they are; roots
// where it only touches zero are no sign changes and are left out.
std::vector<double> SignChanges(const std::vector<double>& coefficients, double low, double high);

}  // namespace mlvi

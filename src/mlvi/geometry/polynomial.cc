// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/polynomial.h"

namespace mlvi {
namespace {

// The root in [low, high], where the polynomial has signs that differ and is monotonic.
double Bisect(const std::vector<double>& coefficients, double low, double high) {
  const bool low_positive = EvaluatePolynomial(coefficients, low) > 0.0;
  while (true) {
    const double middle = low + 0.5 * (high - low);
    if (middle <= low || middle >= high) return middle;  // neighbours in double precision
    ((EvaluatePolynomial(coefficients, middle) > 0.0) == low_positive ? low : high) = middle;
  }
}

}  // namespace

double EvaluatePolynomial(const std::vector<double>& coefficients, double x) {
  double value = 0.0;
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) value = value * x + *c;
  return value;
}

std::vector<double> SignChanges(const std::vector<double>& coefficients, double low, double high) {
  if (coefficients.size() < 2) return {};
  std::vector<double> derivative;
  for (std::size_t i = 1; i < coefficients.size(); ++i) {
    derivative.push_back(static_cast<double>(i) * coefficients[i]);
  }
  std::vector<double> bounds = SignChanges(derivative, low, high);
  // An extremum at zero only touches it.
  std::erase_if(bounds, [&](double x) { return EvaluatePolynomial(coefficients, x) == 0.0; });
  bounds.insert(bounds.begin(), low);
  bounds.push_back(high);
  std::vector<double> roots;
  for (std::size_t i = 1; i < bounds.size(); ++i) {
    const double left = EvaluatePolynomial(coefficients, bounds[i - 1]);
    const double right = EvaluatePolynomial(coefficients, bounds[i]);
    if ((left < 0.0 && right > 0.0) || (left > 0.0 && right < 0.0)) {
      roots.push_back(Bisect(coefficients, bounds[i - 1], bounds[i]));
    }
  }
  return roots;
}

}  // namespace mlvi

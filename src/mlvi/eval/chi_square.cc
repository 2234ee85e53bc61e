// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/chi_square.h"

#include <cmath>
#include <limits>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kMaxIterations = 1'000'000;  // the series needs a few sqrt(dof) terms

// x^a e^-x / Gamma(a)
double GammaFactor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

// Lower regularised incomplete gamma function by its series; for x < a + 1 (Abramowitz and Stegun
// 6.5.29).
double LowerGammaSeries(double a, double x) {
  double term = 1.0 / a, sum = term;
  for (int n = 1; n < kMaxIterations && term > kEpsilon * sum; ++n) sum += term *= x / (a + n);
  return sum * GammaFactor(a, x);
}

// Upper one by its continued fraction (6.5.31) in Lentz's method; for x >= a + 1.
double UpperGammaFraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, value = d;
  for (int n = 1; n < kMaxIterations; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = numerator * d + b;
    c = b + numerator / c;
    if (std::abs(d) < kTiny) d = kTiny;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    value *= c * d;
    if (std::abs(c * d - 1.0) < kEpsilon) break;
  }
  return value * GammaFactor(a, x);
}

}  // namespace

double ChiSquareProbability(double x, double dof) {
  MLVI_CHECK(dof > 0.0, "{} degrees of freedom", dof);
  if (!(x > 0.0)) return 0.0;
  const double a = 0.5 * dof, half = 0.5 * x;
  return half < a + 1.0 ? LowerGammaSeries(a, half) : 1.0 - UpperGammaFraction(a, half);
}

double ChiSquareQuantile(double p, double dof) {
  MLVI_CHECK(p > 0.0 && p < 1.0, "probability {}", p);
  double low = 0.0, high = dof + 1.0;
  while (ChiSquareProbability(high, dof) < p) high *= 2.0;
  // Bisection: the distribution function is monotonic, and this is not a hot path.
  while (high - low > 1e-13 * high) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (ChiSquareProbability(middle, dof) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace mlvi

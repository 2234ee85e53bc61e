// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/polynomial.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "mlvi/geometry/geometry_generators.h"

namespace mlvi {
namespace {

std::vector<double> FromRoots(const std::vector<double>& roots) {
  std::vector<double> coefficients = {1.0};
  for (const double root : roots) {
    coefficients.push_back(0.0);
    for (std::size_t i = coefficients.size(); i-- > 0;) {
      coefficients[i] = (i > 0 ? coefficients[i - 1] : 0.0) - root * coefficients[i];
    }
  }
  return coefficients;
}

RC_GTEST_PROP(Polynomial, FindsAllRootsInTheInterval, ()) {
  std::vector<double> roots;
  for (int i = 0; i < 4; ++i) roots.push_back(*testing::Real(-3.0, 3.0));
  std::sort(roots.begin(), roots.end());
  for (int i = 1; i < 4; ++i) RC_PRE(roots[i] - roots[i - 1] > 1e-2);
  std::vector<double> expected;
  for (const double root : roots) {
    RC_PRE(std::abs(root + 2.0) > 1e-6 && std::abs(root - 2.0) > 1e-6);
    if (root > -2.0 && root < 2.0) expected.push_back(root);
  }
  const std::vector<double> found = SignChanges(FromRoots(roots), -2.0, 2.0);
  RC_ASSERT(found.size() == expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) RC_ASSERT(std::abs(found[i] - expected[i]) < 1e-8);
}

TEST(Polynomial, EvaluatesByHorner) {
  EXPECT_DOUBLE_EQ(EvaluatePolynomial({1.0, -2.0, 0.5}, 3.0), 1.0 - 6.0 + 4.5);
  EXPECT_EQ(EvaluatePolynomial({}, 3.0), 0.0);
}

TEST(Polynomial, SpecialCases) {
  EXPECT_TRUE(SignChanges({2.0}, -1.0, 1.0).empty());
  EXPECT_TRUE(SignChanges({1.0, 0.0, 1.0}, -5.0, 5.0).empty());
  EXPECT_TRUE(SignChanges({0.0, 0.0, 1.0}, -5.0, 5.0).empty());  // touches zero
  EXPECT_EQ(SignChanges({-1.0, 0.0, 1.0}, 0.0, 5.0), std::vector<double>{1.0});
  // Degree lower than written: as distortion with trailing zeros has it.
  EXPECT_EQ(SignChanges({-0.5, 1.0, 0.0, 0.0}, 0.0, 5.0), std::vector<double>{0.5});
}

}  // namespace
}  // namespace mlvi

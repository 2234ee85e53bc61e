// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/outlier_limit.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

std::vector<double> Errors(double sigma, double share_of_outliers, int count) {
  RandomStream random(1, "errors");
  std::vector<double> errors;
  for (int i = 0; i < count; ++i) {
    const bool outlier = i < share_of_outliers * count;
    errors.push_back(outlier ? random.Uniform(50.0, 100.0) : std::abs(sigma * random.Normal()));
  }
  return errors;
}

TEST(OutlierLimit, FollowsTheScatter) {
  // A median of n values of |x| scatters by 1.17 / sqrt(n) of a sigma: 1.2 % here; four of these.
  for (const double sigma : {0.01, 1.0, 7.0}) {
    EXPECT_NEAR(OutlierLimit(Errors(sigma, 0.0, 10000), 0.0, 4.0) / sigma, 4.0, 4.0 * 0.047);
  }
}

TEST(OutlierLimit, ManyOutliersWidenItButDoNotCarryItAway) {
  // With 40 % of them the median is the 83rd percentile of the others: 1.38 sigmas for 0.6745.
  EXPECT_NEAR(OutlierLimit(Errors(1.0, 0.4, 10000), 0.0, 4.0), 4.0 * 1.383 / 0.6745, 0.6);
}

TEST(OutlierLimit, HasALeastValue) {
  EXPECT_EQ(OutlierLimit(Errors(0.01, 0.0, 100), 1.0, 4.0), 1.0);
  EXPECT_EQ(OutlierLimit({}, 1.5, 4.0), 1.5);
  EXPECT_EQ(OutlierLimit({0.0}, 0.5, 4.0), 0.5);
}

}  // namespace
}  // namespace mlvi

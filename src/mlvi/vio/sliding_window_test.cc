// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/sliding_window.h"

#include <gtest/gtest.h>

#include "mlvi/vio/testing.h"

namespace mlvi {
namespace {

WindowConfig ConfigFor(const test::SyntheticOptions& options) {
  WindowConfig config;
  config.pixel_sigma = options.pixel_noise;
  return config;
}

TEST(SlidingWindowTest, StaysWithTheTruth) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  ASSERT_EQ(run.estimates.size(), 99U);
  for (std::size_t i = 0; i < run.estimates.size(); ++i) {
    ASSERT_TRUE(run.estimates[i].solved);
    const Vector15d error = BoxMinus(run.truth[i], run.estimates[i].newest.state);
    const Vector15d sigma = run.estimates[i].newest.covariance.diagonal().cwiseSqrt();
    // Robustly within what the window itself claims.
    EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 6.0) << "set " << i;
  }
  // Noise in pixels shows up as it was put in: the anchor's own noise adds up to sqrt 2.
  EXPECT_GT(run.estimates.back().rms_px, 0.8 * options.pixel_noise);
  EXPECT_LT(run.estimates.back().rms_px, 1.42 * options.pixel_noise);
  EXPECT_GT(run.keyframes, 15);
}

}  // namespace
}  // namespace mlvi

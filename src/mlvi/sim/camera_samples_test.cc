// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_samples.h"

#include <gtest/gtest.h>

#include <set>

namespace mlvi::internal {
namespace {

// Products of time and place that do not cancel would sharpen edges that move one way.
TEST(PixelSamples, LieEvenlyAboutTheMiddleWhateverMoves) {
  for (const auto& samples : {FewSamples(), ManySamples()}) {
    const auto n = static_cast<double>(samples.size());
    double time = 0.0, x = 0.0, y = 0.0, time2 = 0.0, tx = 0.0, ty = 0.0;
    for (const PixelSample& s : samples) {
      EXPECT_LT(std::abs(s.time), 0.5);
      EXPECT_LE(std::max(std::abs(s.dx), std::abs(s.dy)), 0.5F);
      time += s.time / n, x += s.dx / n, y += s.dy / n;
      time2 += s.time * s.time / n, tx += s.time * s.dx / n, ty += s.time * s.dy / n;
    }
    EXPECT_NEAR(time, 0.0, 1e-9);
    EXPECT_NEAR(x, 0.0, 0.02);  // those that would leave the pixel are held back
    EXPECT_NEAR(y, 0.0, 0.02);
    EXPECT_LT(std::max(std::abs(tx), std::abs(ty)), 0.25 * time2);
  }
}

TEST(PixelSamples, EightHaveARowAColumnAndAnInstantEach) {
  std::set<double> times, columns, rows;
  for (const PixelSample& s : FewSamples()) {
    times.insert(s.time);
    columns.insert(s.dx);
    rows.insert(s.dy);
  }
  EXPECT_EQ(times.size(), kFewSamples);
  EXPECT_EQ(columns.size(), kFewSamples);
  EXPECT_EQ(rows.size(), kFewSamples);
}

TEST(PixelSamples, AreGroupedByTheSurfaceThatTheyMet) {
  const auto samples = FewSamples();
  std::array<Sight, kFewSamples> sights;
  for (std::size_t k = 0; k < sights.size(); ++k) {
    sights[k].hit = {.range = 2.0F, .normal = Eigen::Vector3f::UnitX()};
    sights[k].plane = 2.0F;
    sights[k].surface = samples[k].dx < 0.2F ? 1 : 2;  // six columns of eight on the first
  }
  std::vector<SampleGroup> groups = {{}, {}, {}};
  GroupBySurface(sights, samples, groups);
  ASSERT_EQ(groups.size(), 2U);
  for (const SampleGroup& group : groups) {
    const bool first = sights[group.sample].surface == 1;
    EXPECT_EQ(group.share, first ? 0.75F : 0.25F);
  }
  EXPECT_NE(sights[groups[0].sample].surface, sights[groups[1].sample].surface);
}

}  // namespace
}  // namespace mlvi::internal

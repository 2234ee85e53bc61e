// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/compensation.h"

#include <gtest/gtest.h>

#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

using enum Compensation;

using Setting = test::ViewSetting;
using test::MakeRandomViews;
using Scene = test::RandomViews;

TEST(Compensation, RayIsExactWithoutNoise) {
  RandomStream random(2);
  for (int trial = 0; trial < 500; ++trial) {
    const Scene s =
        MakeRandomViews({.offset = 0.3, .depth = random.Uniform(1.0, 50.0), .views = 4}, random);
    const auto two = TriangulateTwoViews(s.views[0], s.views[1], kRay);
    ASSERT_TRUE(two.has_value());
    EXPECT_LT((*two - s.point).norm(), 1e-6 * s.point.norm());
    const auto many = TriangulateViews(s.views, kRay);
    ASSERT_TRUE(many.has_value());
    EXPECT_LT((many->point - s.point).norm(), 1e-6 * s.point.norm());
  }
}

// Eq. (8): planes through S, C and u hold the point exactly, so three of them in general position
// find it.
TEST(Compensation, StackedPlanesAreExactWithoutNoise) {
  RandomStream random(3);
  int found = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Scene s =
        MakeRandomViews({.offset = 0.3, .depth = 5.0, .baseline = 1.0, .views = 6}, random);
    const auto result = TriangulateViews(s.views, kPlane);
    if (!result) continue;
    ++found;
    EXPECT_LT((result->point - s.point).norm(), 1e-4 * s.point.norm());
  }
  EXPECT_GT(found, 450);
}

// Eq. (3)-(7) hold their geometry: P lies on the line through P' along m, which lies in both
// planes' directions, and where S-rays are not skew (the motion keeps S, C, u, P in one plane) P is
// the point.
TEST(Compensation, TwoViewPlaneMovesAlongBothPlanes) {
  RandomStream random(4);
  for (int trial = 0; trial < 300; ++trial) {
    const Scene s = MakeRandomViews({.offset = 0.2, .depth = 6.0}, random);
    const auto before = TriangulateTwoViews(s.views[0], s.views[1], kNone);
    const auto after = TriangulateTwoViews(s.views[0], s.views[1], kPlane);
    ASSERT_EQ(before.has_value(), after.has_value());
    if (!before) continue;
    for (const PanoramicView& view : s.views) {
      const Eigen::Vector3d normal =
          view.T_world_pano.rotation() * view.observation.center.cross(view.observation.point);
      EXPECT_LT(std::abs(normal.normalized().dot(*after - *before)),
                1e-6 * (1.0 + (*after - *before).norm()));
    }
  }
}

TEST(Compensation, ModesAgreeWithoutOffsetAndAtTheDepthOfTheSphere) {
  RandomStream random(5);
  for (const Setting& options : {Setting{.offset = 0.0, .depth = 7.0},
                                 Setting{.depth = 4.0, .radius = 4.0, .baseline = 0.0}}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Scene s = MakeRandomViews(options, random);
      const Ray exact = WorldRay(s.views[0], kRay), sphere = WorldRay(s.views[0], kNone);
      EXPECT_LT((sphere.At(options.depth) - s.point).norm(), 1e-6);
      EXPECT_LT((exact.At((s.point - exact.origin).norm()) - s.point).norm(), 1e-6);
    }
  }
}

// Random two-view geometry: 8 cm offset, baseline 0.5 m, depth 10 m, r = 1 m, a turn of 10 degrees.
TEST(Compensation, DepthErrorsOfTheModes) {
  const Setting clean;
  EXPECT_NEAR(test::MedianDepthError(clean, kNone, 3000), 0.12, 0.01);
  EXPECT_NEAR(test::MedianDepthError(clean, kPlane, 3000), 0.105, 0.01);
  EXPECT_LT(test::MedianDepthError(clean, kRay, 3000), 1e-9);
  const Setting noisy{.noise = 2e-3};
  EXPECT_NEAR(test::MedianDepthError(noisy, kNone, 3000), 0.125, 0.01);
  EXPECT_NEAR(test::MedianDepthError(noisy, kPlane, 3000), 0.137, 0.015);
  EXPECT_NEAR(test::MedianDepthError(noisy, kRay, 3000), 0.05, 0.005);
}

// Without rotation the planes of one camera all hold its offset direction: their intersection has
// no depth.
TEST(Compensation, PlanesOfOneCameraNeedRotation) {
  RandomStream random(7);
  for (int trial = 0; trial < 50; ++trial) {
    const Scene s = MakeRandomViews({.rotation = 0.0, .views = 6}, random);
    EXPECT_FALSE(TriangulateViews(s.views, kPlane).has_value());
    EXPECT_TRUE(TriangulateViews(s.views, kRay).has_value());
  }
}

// With noise: NEES 3 and chi-square 2 n - 3 where the noise is small against the parallax.
TEST(Compensation, RayIsEfficientWithNoise) {
  RandomStream random(6);
  double nees = 0.0, chi_square = 0.0;
  constexpr int kTrials = 1500;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Scene s = MakeRandomViews(
        {.offset = 0.3, .depth = 4.0, .baseline = 1.0, .noise = 5e-4, .views = 5}, random);
    const auto result = TriangulateViews(s.views, kRay);
    ASSERT_TRUE(result.has_value());
    const Eigen::Vector3d error = result->point - s.point;
    nees += error.dot(result->covariance.inverse() * error) / kTrials;
    chi_square += result->chi_square / kTrials;
  }
  EXPECT_NEAR(nees, 3.0, 0.25);        // four sigmas of the mean: 4 sqrt(6 / 1500)
  EXPECT_NEAR(chi_square, 7.0, 0.39);  // 4 sqrt(14 / 1500)
}

}  // namespace
}  // namespace mlvi

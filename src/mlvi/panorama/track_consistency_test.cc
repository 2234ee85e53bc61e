// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_consistency.h"

#include <gtest/gtest.h>

#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/tangent_basis.h"

namespace mlvi {
namespace {

constexpr double kPixel = 1.0 / 350.0;  // rad

// A point seen from places 7 cm apart, `off(i)` px beside it along the first axis of the tangent
// plane.
template <typename Off>
std::vector<Ray> Look(const Eigen::Vector3d& point, const Off& off) {
  std::vector<Ray> rays;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d origin(0.0, 0.07 * i, 0.0);
    const Eigen::Vector3d d = (point - origin).normalized();
    const Eigen::Vector3d moved = d + TangentBasis(d).col(0) * (kPixel * off(i));
    rays.push_back({origin, moved.normalized(), kPixel});
  }
  return rays;
}

TEST(TrackConsistency, FixedPointsAreHitWhereverTheyAre) {
  RandomStream random(1, "points");
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const double distance = std::pow(10.0, random.Uniform(0.0, 6.0));
    EXPECT_LT(LargestMiss(Look(distance * direction, [](int) { return 0.0; })), 1e-4);
    // Noise puts far points behind half of the time: it is missed by no more than the noise, of
    // which each place has a tenth of a pixel per axis: five sigmas.
    const auto noisy = [&](int) { return 0.1 * random.Normal(); };
    EXPECT_LT(LargestMiss(Look(distance * direction, noisy)), 0.5);
  }
}

TEST(TrackConsistency, WhatJumpsOrMovesMissesIt) {
  const Eigen::Vector3d point(5.0, 0.0, 0.3);
  for (const double jump : {2.0, 4.0}) {
    const double miss = LargestMiss(Look(point, [&](int i) { return i == 2 ? jump : 0.0; }));
    // A line in time through four values, one of them off by d, misses it by 0.7 d; across the
    // epipolar plane the mean does, by 3/4 d.
    EXPECT_GT(miss, 0.6 * jump);
    EXPECT_LT(miss, jump);
  }
  // A person who walks at 1 m/s across the way of the rig, 0.1 s between sets.
  std::vector<Ray> rays = Look(point, [](int) { return 0.0; });
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d walked(0.0, 0.0, 0.1 * static_cast<double>(i));
    rays[i].direction = (point + walked - rays[i].origin).normalized();
  }
  EXPECT_GT(LargestMiss(rays), 5.0);
}

}  // namespace
}  // namespace mlvi

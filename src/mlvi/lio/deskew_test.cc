// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/deskew.h"

#include <gtest/gtest.h>

#include "mlvi/base/error.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);

std::vector<NavState> Trajectory(const test::SwingMotion& motion, double from, double to) {
  std::vector<NavState> states;
  for (double t = from; t < to + 0.0049; t += 0.005) states.push_back(motion.StateAt(t, kBegin));
  return states;
}

TEST(Deskew, PutsEveryPointWhereItIsAtTheEndOfTheSweep) {
  const test::SwingMotion motion{.speed = 4.0};  // up to 3 rad/s and 2.4 m/s
  const test::BoxWorld world = test::FurnishedRoom();
  Rig rig = test::MakeTestRig();
  rig.lidar->range_noise = 0.0;
  const LidarSweep sweep = test::Scan(world, motion, *rig.lidar, 0.3, kBegin, RandomStream(1));
  const DeskewedSweep deskewed = Deskew(sweep, Trajectory(motion, 0.3, 0.4), *rig.lidar);
  ASSERT_EQ(deskewed.points.size(), sweep.points.size());
  EXPECT_EQ(deskewed.stamp, sweep.end());
  const Pose3 T_end_world = motion.At(0.3 + sweep.span.seconds()).inverse();
  double worst = 0.0, worst_raw = 0.0;
  for (std::size_t i = 0; i < deskewed.points.size(); ++i) {
    const LidarPoint& point = sweep.points[deskewed.sources[i]];
    const Eigen::Vector3d lidar = point.position.cast<double>();
    const Eigen::Vector3d exact =
        T_end_world * (motion.At(0.3 + 1e-9 * point.offset_ns) * (rig.lidar->T_body_lidar * lidar));
    worst = std::max(worst, (deskewed.points[i].cast<double>() - exact).norm());
    worst_raw = std::max(worst_raw, (rig.lidar->T_body_lidar * lidar - exact).norm());
  }
  // Interpolation of states 5 ms apart: angular acceleration (up to 21 rad/s^2) * dt^2 / 8 = 6.6e-5
  // rad, at 7.5 m.
  EXPECT_LT(worst, 5e-4);
  EXPECT_GT(worst_raw, 0.5);  // there was something to correct
}

TEST(Deskew, TakesASweepWithoutTimesAsInstantaneous) {
  const test::SwingMotion motion{.speed = 4.0};
  const Rig rig = test::MakeTestRig();
  LidarSweep sweep;
  sweep.stamp = kBegin + Duration::FromMilliseconds(350);
  for (int i = 0; i < 10; ++i) sweep.points.push_back({.position = {1.0F + i, 2.0F, 0.5F}});
  const DeskewedSweep deskewed = Deskew(sweep, Trajectory(motion, 0.3, 0.4), *rig.lidar);
  ASSERT_EQ(deskewed.points.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d expected =
        rig.lidar->T_body_lidar * sweep.points[i].position.cast<double>();
    EXPECT_LT((deskewed.points[i].cast<double>() - expected).norm(), 1e-5);
  }
}

TEST(Deskew, DropsPointsBeyondTheLimitsOfRange) {
  Rig rig = test::MakeTestRig();
  rig.lidar->min_range = 1.0;
  rig.lidar->max_range = 20.0;
  LidarSweep sweep;
  sweep.stamp = kBegin;
  for (const float x : {0.5F, 1.5F, 19.0F, 21.0F, std::nanf("")}) {
    sweep.points.push_back({.position = {x, 0.0F, 0.0F}});
  }
  NavState still;
  still.stamp = kBegin;
  const DeskewedSweep deskewed = Deskew(sweep, std::vector<NavState>{still}, *rig.lidar);
  EXPECT_EQ(deskewed.sources, (std::vector<std::size_t>{1, 2}));
  EXPECT_THROW(Deskew(sweep, {}, *rig.lidar), ContractViolation);
}

}  // namespace
}  // namespace mlvi

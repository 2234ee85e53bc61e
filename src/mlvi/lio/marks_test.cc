// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/marks.h"

#include <gtest/gtest.h>

#include "mlvi/lio/deskew.h"
#include "mlvi/lio/mark_map.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kProud = 0.06;  // m, how far the pilaster stands out from the wall
constexpr double kNear = 3.0, kFar = 4.0;

struct Still {
  Pose3 T;
  Pose3 At(double) const { return T; }
};

// A corridor along x; its pilaster's faces along x are 6 cm wide.
test::BoxWorld CorridorWithPilaster() {
  test::BoxWorld world = test::EndlessCorridor();
  world.obstacles = {{{kNear, -1.2, -1.2}, {kFar, -1.2 + kProud, 1.6}}};
  return world;
}

// A sweep in the body frame.
PointCloud SweepOf(const test::BoxWorld& world, const Pose3& T, std::uint64_t seed) {
  const Rig rig = test::MakeTestRig();
  const LidarSweep sweep = test::Scan(world, Still{T}, *rig.lidar, 0.0, kBegin, RandomStream(seed),
                                      {.rings = 96, .columns = 1200});
  NavState state;
  state.stamp = kBegin;
  return Deskew(sweep, std::vector<NavState>{state}, *rig.lidar).points;
}

PointCloud MarksOf(const test::BoxWorld& world, const Pose3& T, std::uint64_t seed) {
  const PointCloud points = SweepOf(world, T, seed);
  const Eigen::Vector3d axis = T.rotation().conjugate() * Eigen::Vector3d::UnitX();
  PointCloud marks;
  for (const std::size_t i : FindMarks(points, axis, 0.01, MarkConfig()))
    marks.push_back(points[i]);
  return marks;
}

const Pose3 kPose(ExpSo3(Eigen::Vector3d(0.1, -0.05, 0.6)), {0.0, 0.1, 0.0});

TEST(Marks, AreThePointsOnNarrowFaces) {
  const PointCloud marks = MarksOf(CorridorWithPilaster(), kPose, 1);
  ASSERT_GT(marks.size(), 20U);
  int on_face = 0;
  double mean = 0.0;
  for (const Eigen::Vector3f& p : marks) {
    const Eigen::Vector3d world = kPose * p.cast<double>();
    if (std::abs(world.x() - kNear) > 0.04 || std::abs(world.y() + 1.2 - 0.5 * kProud) > 0.05)
      continue;
    ++on_face;
    mean += world.x();
  }
  EXPECT_GT(on_face, 0.9 * static_cast<double>(marks.size()));
  // 1 cm noise, 20 points: 2.2 mm; four sigmas.
  EXPECT_NEAR(mean / on_face, kNear, 0.009);
}

TEST(Marks, BareWallsHaveHardlyAny) {
  EXPECT_LT(MarksOf(test::EndlessCorridor(), kPose, 1).size(), 20U);  // of 115200 points
}

TEST(MarkMap, FindsTheMeanOfWhatSeveralSweepsHaveSeen) {
  const MarkConfig config;
  MarkMap map(config);
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  for (int sweep = 0; sweep < 4; ++sweep) {
    const Pose3 T(kPose.rotation(), kPose.translation() + Eigen::Vector3d(0.2 * sweep, 0.0, 0.0));
    EXPECT_EQ(map.Find({kNear, -1.17, 0.3}, axis, 0.02).has_value(), sweep >= config.min_sweeps);
    map.Insert(MarksOf(CorridorWithPilaster(), T, sweep), T);
  }
  for (const double offset : {-0.05, 0.0, 0.05}) {
    const auto mark = map.Find({kNear + offset, -1.17, 0.3}, axis, 0.02);
    ASSERT_TRUE(mark.has_value());
    EXPECT_NEAR(mark->mean.x(), kNear, 4.0 * std::sqrt(mark->variance));
    EXPECT_LT(std::sqrt(mark->variance), 0.01);
  }
  EXPECT_FALSE(map.Find({kNear + 0.5, -1.17, 0.3}, axis, 0.02).has_value());
}

TEST(MarkMap, WhatMovesIsNoMark) {
  MarkMap map{MarkConfig()};
  RandomStream random(3);
  for (int sweep = 0; sweep < 10; ++sweep) {
    PointCloud points;
    for (int i = 0; i < 30; ++i) {
      points.emplace_back(0.05F * static_cast<float>(sweep) + 0.01F * random.Normal(),
                          -1.17F + 0.01F * random.Normal(), random.Uniform(0.0, 0.2));
    }
    map.Insert(points, Pose3());
  }
  for (double x = -0.1; x < 0.6; x += 0.02) {
    EXPECT_FALSE(map.Find({x, -1.17, 0.1}, Eigen::Vector3d::UnitX(), 0.02).has_value()) << x;
  }
}

TEST(MarkMap, ForgetsWhatIsFar) {
  MarkMap map{MarkConfig()};
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  for (int sweep = 0; sweep < 4; ++sweep) {
    PointCloud points;
    for (const float x : {0.0F, 20.0F}) {
      for (int i = 0; i < 10; ++i) points.emplace_back(x, -1.17F, 0.01F * static_cast<float>(i));
    }
    map.Insert(points, Pose3());
  }
  ASSERT_TRUE(map.Find({0.0, -1.17, 0.1}, axis, 0.02).has_value());
  map.EraseBeyond({20.0, 0.0, 0.0}, 10.0);
  EXPECT_FALSE(map.Find({0.0, -1.17, 0.1}, axis, 0.02).has_value());
  EXPECT_TRUE(map.Find({20.0, -1.17, 0.1}, axis, 0.02).has_value());
}

}  // namespace
}  // namespace mlvi

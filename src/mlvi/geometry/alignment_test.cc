// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/alignment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "mlvi/base/random.h"
#include "mlvi/geometry/geometry_generators.h"

namespace mlvi {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points RandomPoints(int n, double extent, RandomStream& random) {
  Points points;
  for (int i = 0; i < n; ++i) {
    points.emplace_back(extent * random.Normal(), extent * random.Normal(),
                        extent * random.Normal());
  }
  return points;
}

Points Map(const Similarity3& S, const Points& points) {
  Points mapped;
  for (const Eigen::Vector3d& p : points) mapped.push_back(S * p);
  return mapped;
}

double Cost(const Similarity3& S, const Points& source, const Points& target,
            const std::vector<double>& weights) {
  double cost = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    cost += (weights.empty() ? 1.0 : weights[i]) * (target[i] - S * source[i]).squaredNorm();
  }
  return cost;
}

RC_GTEST_PROP(Alignment, RecoversWhatWasApplied, ()) {
  RandomStream random(*rc::gen::inRange<std::uint64_t>(0, 1'000'000));
  const Points source = RandomPoints(20, 5.0, random);
  const Similarity3 S{.scale = *testing::Real(0.1, 10.0), .pose = *testing::AnyPose(50.0)};
  const auto sim3 = AlignPoints(source, Map(S, source), AlignmentKind::kSim3);
  RC_ASSERT(sim3.has_value());
  RC_ASSERT(std::abs(sim3->scale / S.scale - 1.0) < 1e-12);
  RC_ASSERT((sim3->pose.matrix() - S.pose.matrix()).norm() < 1e-11);

  const Similarity3 rigid{.scale = 1.0, .pose = S.pose};
  const auto se3 = AlignPoints(source, Map(rigid, source), AlignmentKind::kSe3);
  RC_ASSERT(se3.has_value() && se3->scale == 1.0);
  RC_ASSERT((se3->pose.matrix() - S.pose.matrix()).norm() < 1e-11);

  const double yaw = *testing::Real(-3.14, 3.14);
  const Similarity3 turned{
      .scale = 1.0, .pose = Pose3(ExpSo3(yaw * Eigen::Vector3d::UnitZ()), S.pose.translation())};
  const auto found = AlignPoints(source, Map(turned, source), AlignmentKind::kYaw);
  RC_ASSERT(found.has_value());
  RC_ASSERT((found->pose.matrix() - turned.pose.matrix()).norm() < 1e-11);
}

// With noise and weights, no transform nearby does better: a minimum in all directions that the
// kind leaves free.
TEST(Alignment, IsTheWeightedMinimum) {
  RandomStream random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Points source = RandomPoints(30, 3.0, random);
    Points target = Map({.scale = 1.3, .pose = Pose3(ExpSo3({0.3, -2.0, 1.0}), {1, 2, 3})}, source);
    std::vector<double> weights;
    for (Eigen::Vector3d& p : target) {
      p += 0.5 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
      weights.push_back(random.Uniform(0.0, 2.0));
    }
    for (const AlignmentKind kind :
         {AlignmentKind::kSe3, AlignmentKind::kSim3, AlignmentKind::kYaw}) {
      const Similarity3 best = AlignPoints(source, target, kind, weights).value();
      const double cost = Cost(best, source, target, weights);
      for (int i = 0; i < 100; ++i) {
        Similarity3 moved = best;
        Eigen::Vector3d turn(random.Normal(), random.Normal(), random.Normal());
        if (kind == AlignmentKind::kYaw) turn.head<2>().setZero();
        const Eigen::Vector3d shift(random.Normal(), random.Normal(), random.Normal());
        moved.pose = Pose3(ExpSo3(1e-3 * turn) * best.pose.rotation(),
                           best.pose.translation() + 1e-3 * shift);
        if (kind == AlignmentKind::kSim3) moved.scale *= 1.0 + 1e-3 * random.Normal();
        ASSERT_GE(Cost(moved, source, target, weights), cost);
      }
    }
  }
}

// A mirrored set must still give a rotation (Umeyama's sign).
TEST(Alignment, NeverReflects) {
  RandomStream random(4);
  const Points source = RandomPoints(10, 1.0, random);
  Points mirrored = source;
  for (Eigen::Vector3d& p : mirrored) p.x() = -p.x();
  const Similarity3 S = AlignPoints(source, mirrored, AlignmentKind::kSe3).value();
  EXPECT_NEAR(S.pose.R().determinant(), 1.0, 1e-12);
}

TEST(Alignment, PointsInAPlaneSuffice) {
  RandomStream random(5);
  Points source = RandomPoints(10, 1.0, random);
  for (Eigen::Vector3d& p : source) p.z() = 0.0;
  const Similarity3 S{.scale = 1.0, .pose = Pose3(ExpSo3({1.0, 2.0, 0.5}), {4, 5, 6})};
  const Similarity3 found = AlignPoints(source, Map(S, source), AlignmentKind::kSe3).value();
  EXPECT_LT((found.pose.matrix() - S.pose.matrix()).norm(), 1e-12);
}

TEST(Alignment, DegenerateInputsAreErrors) {
  Points line, column;
  for (int i = 0; i < 10; ++i) {
    line.emplace_back(i, 2.0 * i, 0.5 * i);
    column.emplace_back(1.0, 2.0, i);
  }
  const auto error = AlignPoints(line, line, AlignmentKind::kSe3).error();
  EXPECT_EQ(error.kind, ErrorKind::kInput);
  EXPECT_THAT(error.message, ::testing::HasSubstr("10 points"));
  EXPECT_THAT(error.message, ::testing::HasSubstr("'yaw'"));
  EXPECT_FALSE(AlignPoints(line, line, AlignmentKind::kSim3));
  EXPECT_TRUE(AlignPoints(line, line, AlignmentKind::kYaw));
  EXPECT_FALSE(AlignPoints(column, column, AlignmentKind::kYaw));
  EXPECT_FALSE(AlignPoints({}, {}, AlignmentKind::kSe3));
  const Points same(5, Eigen::Vector3d(1, 2, 3));
  for (const AlignmentKind kind :
       {AlignmentKind::kSe3, AlignmentKind::kSim3, AlignmentKind::kYaw}) {
    EXPECT_FALSE(AlignPoints(same, same, kind));
    EXPECT_FALSE(AlignPoints(line, line, kind, std::vector<double>(10, 0.0)));
  }
  EXPECT_TRUE(AlignPoints(same, same, AlignmentKind::kNone));
  EXPECT_THROW(AlignPoints(line, same, AlignmentKind::kSe3).has_value(), ContractViolation);
}

RC_GTEST_PROP(Similarity3, MapsPosesAsItMapsPoints, ()) {
  const Similarity3 S{.scale = *testing::Real(0.1, 10.0), .pose = *testing::AnyPose(10.0)};
  const Pose3 pose = *testing::AnyPose(10.0);
  RC_ASSERT(((S * pose).translation() - S * pose.translation()).norm() < 1e-11);
  RC_ASSERT(((S * pose).R() - S.pose.R() * pose.R()).norm() < 1e-13);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/spline.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

constexpr std::int64_t kEpochNs = 1'700'000'000'000'000'000;

Time At(double seconds) { return Time::FromNanoseconds(kEpochNs) + Duration::FromSeconds(seconds); }

Eigen::Vector3d RandomVector(RandomStream& random, double scale) {
  return scale * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
}

// Rotation steps of up to about 1 rad per knot: far beyond what a walk needs.
PoseSpline RandomSpline(std::uint64_t seed, double rotation_scale = 0.5) {
  RandomStream random(seed, "spline");
  std::vector<Pose3> controls(1);
  for (int i = 1; i < 24; ++i) {
    const Pose3& last = controls.back();
    controls.emplace_back(last.rotation() * ExpSo3(RandomVector(random, rotation_scale)),
                          last.translation() + RandomVector(random, 0.3));
  }
  return PoseSpline(At(0.0), Duration::FromMilliseconds(100), controls);
}

// A smooth analytic motion to fit.
Pose3 Wave(double t) {
  return Pose3(ExpSo3({0.4 * std::sin(1.1 * t), 0.3 * std::cos(0.7 * t), 0.8 * t}),
               {2.0 * std::sin(0.5 * t), 1.2 * t, 0.1 * std::cos(3.0 * t)});
}

class SplineLaws : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SplineLaws, DerivativesMatchNumericDifferentiation) {
  const PoseSpline spline = RandomSpline(GetParam());
  RandomStream random(GetParam(), "times");
  const double h =
      1e-4;  // s; central differences: error of order h^2 times the next derivatives but one
  for (int i = 0; i < 50; ++i) {
    // Keep the stencil inside one segment: the third derivative jumps at knots.
    const double t = 0.1 * std::floor(random.Uniform(0.0, 21.0)) + random.Uniform(0.001, 0.099);
    const MotionSample here = spline.At(At(t)), before = spline.At(At(t - h)),
                       after = spline.At(At(t + h));
    const Eigen::Vector3d velocity =
        (after.T_world_body.translation() - before.T_world_body.translation()) / (2.0 * h);
    EXPECT_LT((velocity - here.velocity).norm(), 1e-4);
    EXPECT_LT(((after.velocity - before.velocity) / (2.0 * h) - here.acceleration).norm(), 1e-6);
    const Eigen::Vector3d rate =
        LogSo3(before.T_world_body.rotation().conjugate() * after.T_world_body.rotation()) /
        (2.0 * h);
    EXPECT_LT((rate - here.angular_velocity).norm(), 1e-3);
    const Eigen::Vector3d turn = (after.angular_velocity - before.angular_velocity) / (2.0 * h);
    EXPECT_LT((turn - here.angular_acceleration).norm(),
              1e-4 * (1.0 + here.angular_acceleration.norm()));
    EXPECT_LT(BoxMinus(spline.PoseAt(At(t)), here.T_world_body).norm(), 1e-12);
  }
}

TEST_P(SplineLaws, TwiceContinuouslyDifferentiableAtKnots) {
  const PoseSpline spline = RandomSpline(GetParam());
  for (int knot = 1; knot < 21; ++knot) {
    const Time at = spline.begin() + spline.knot_interval() * knot;
    const MotionSample left = spline.At(at - Duration::FromNanoseconds(1)), right = spline.At(at);
    EXPECT_LT(BoxMinus(left.T_world_body, right.T_world_body).norm(), 1e-7);
    EXPECT_LT((left.velocity - right.velocity).norm(), 1e-6);
    EXPECT_LT((left.acceleration - right.acceleration).norm(), 1e-5);
    EXPECT_LT((left.angular_velocity - right.angular_velocity).norm(), 1e-6);
    EXPECT_LT((left.angular_acceleration - right.angular_acceleration).norm(), 1e-4);
  }
}

TEST_P(SplineLaws, ChangeOfFrameLeavesBodyQuantitiesAlone) {
  const PoseSpline spline = RandomSpline(GetParam());
  RandomStream random(GetParam(), "frame");
  const Pose3 T(ExpSo3(RandomVector(random, 1.0)), RandomVector(random, 5.0));
  const PoseSpline moved = spline.Transformed(T);
  for (double t = 0.0; t <= 2.1; t += 0.1) {
    const MotionSample a = spline.At(At(t)), b = moved.At(At(t));
    EXPECT_LT(BoxMinus(T * a.T_world_body, b.T_world_body).norm(), 1e-12);
    EXPECT_LT((T.rotation() * a.acceleration - b.acceleration).norm(), 1e-10);
    EXPECT_LT((a.angular_velocity - b.angular_velocity).norm(), 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SplineLaws, ::testing::Values(1, 2, 3, 4, 5));

TEST(PoseSpline, LinearMotionIsReproduced) {
  std::vector<Pose3> controls;
  const Eigen::Vector3d step(0.1, -0.2, 0.05), turn(0.02, 0.03, -0.05);
  for (int i = -1; i < 9; ++i) controls.emplace_back(ExpSo3(i * turn), i * step);
  const PoseSpline spline(At(0.0), Duration::FromMilliseconds(100), controls);
  const MotionSample sample = spline.At(At(0.37));
  EXPECT_LT(BoxMinus(sample.T_world_body, Pose3(ExpSo3(3.7 * turn), 3.7 * step)).norm(), 1e-12);
  EXPECT_LT((sample.velocity - 10.0 * step).norm(), 1e-12);
  EXPECT_LT((sample.angular_velocity - 10.0 * turn).norm(), 1e-12);
  EXPECT_LT(sample.acceleration.norm() + sample.angular_acceleration.norm(), 1e-10);
}

TEST(PoseSpline, RefusesTimesOutside) {
  const PoseSpline spline = RandomSpline(1);
  EXPECT_NO_THROW(spline.At(spline.end()));
  EXPECT_THROW(spline.At(spline.begin() - Duration::FromNanoseconds(1)), ContractViolation);
  EXPECT_THROW(spline.At(spline.end() + Duration::FromNanoseconds(1)), ContractViolation);
}

// Densely and irregularly timed poses are met, and the motion between them as well.
TEST(FitPoseSpline, MeetsIrregularPoses) {
  RandomStream random(7, "fit");
  std::vector<Time> stamps;
  std::vector<Pose3> poses;
  for (double t = 0.0; t < 20.0; t += random.Uniform(0.02, 0.08)) {
    stamps.push_back(At(t));
    poses.push_back(Wave(t));
  }
  const auto spline = FitPoseSpline(stamps, poses);
  ASSERT_TRUE(spline.has_value()) << spline.error().message;
  EXPECT_EQ(spline->begin(), stamps.front());
  EXPECT_GE(spline->end(), stamps.back());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    EXPECT_LT(BoxMinus(spline->PoseAt(stamps[i]), poses[i]).norm(), 1e-5) << i;
  }
  const double last = (stamps.back() - stamps.front()).seconds();
  for (double t = 0.5; t < last - 0.5; t += 0.013) {
    EXPECT_LT(BoxMinus(spline->PoseAt(At(t)), Wave(t)).norm(), 2e-5) << t;
  }
}

// Poses at 2 Hz, as LiDAR odometry of slow sweeps publishes them: met, and bridged smoothly.
TEST(FitPoseSpline, BridgesSparsePoses) {
  std::vector<Time> stamps;
  std::vector<Pose3> poses;
  for (int i = 0; i <= 40; ++i) {
    stamps.push_back(At(0.5 * i));
    poses.push_back(Wave(0.5 * i));
  }
  const auto spline = FitPoseSpline(stamps, poses);
  ASSERT_TRUE(spline.has_value()) << spline.error().message;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    EXPECT_LT(BoxMinus(spline->PoseAt(stamps[i]), poses[i]).norm(), 1e-3) << i;
  }
  for (double t = 1.0; t < 19.0; t += 0.05) {
    EXPECT_LT(spline->At(At(t)).acceleration.norm(), 3.0) << t;  // the wave stays below 1.5
  }
}

TEST(FitPoseSpline, AnswersBadInputWithReasons) {
  const std::vector<Pose3> poses(2);
  const std::vector<Time> repeated = {At(1.0), At(1.0)};
  const auto result = FitPoseSpline(repeated, poses);
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("not later"), std::string::npos);
  EXPECT_FALSE(FitPoseSpline(std::span(repeated).first(1), std::span(poses).first(1)).has_value());
}

}  // namespace
}  // namespace mlvi

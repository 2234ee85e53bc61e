// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/slam.h"

#include <gtest/gtest.h>

#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kPeriod = 0.1;

// Plays the furnished room, seen from a swinging body, to `slam`: sweeps behind the samples that
// cover them.
void Play(double seconds, const test::SwingMotion& motion, Slam& slam) {
  const Rig rig = test::MakeTestRig();
  const test::BoxWorld world = test::FurnishedRoom();
  for (int k = 0; (k + 1) * kPeriod <= seconds; ++k) {
    const double t = k * kPeriod;
    slam.Process(test::Scan(world, motion, *rig.lidar, t, kBegin, RandomStream(5).Fork(k)));
    for (const ImuSample& sample :
         test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(6))) {
      slam.Process(sample);
    }
  }
  slam.Finish();
}

// Keyframes so often that several come out of the start, and a LiDAR trusted so little that the
// graph has something to correct.
SlamConfig CorrectingConfig(GraphFeedback feedback) {
  SlamConfig config;
  config.feedback = feedback;
  config.graph.keyframe_distance = 0.1;
  config.graph.lidar_position_sigma = 0.02;
  return config;
}

class FeedbackTest : public ::testing::Test {
 protected:
  FeedbackTest() {
    Play(5.0, {.speed = 1.5}, without_);
    Play(5.0, {.speed = 1.5}, with_);
  }

  Slam without_{CorrectingConfig(GraphFeedback::kNever), test::MakeTestRig()};
  Slam with_{CorrectingConfig(GraphFeedback::kAlways), test::MakeTestRig()};
};

TEST_F(FeedbackTest, TheGraphGetsTheSameFactors) {
  ASSERT_GT(with_.graph().keyframes().size(), 10U);
  ASSERT_EQ(with_.graph().keyframes().size(), without_.graph().keyframes().size());
  for (const Keyframe& keyframe : with_.graph().keyframes()) {
    EXPECT_EQ(BoxMinus(with_.graph().Estimate(keyframe.id), without_.graph().Estimate(keyframe.id))
                  .norm(),
              0.0);
  }
}

TEST_F(FeedbackTest, TheOdometryMovesAsWithoutIt) {
  const Trajectory &a = without_.odometry(), &b = with_.odometry();
  ASSERT_EQ(a.size(), b.size());
  int corrected = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    const Pose3 step_a = a[i - 1].pose.inverse() * a[i].pose,
                step_b = b[i - 1].pose.inverse() * b[i].pose;
    // Beyond corrections, of which each keyframe brings at most one, the same motion.
    const double difference = BoxMinus(step_a, step_b).norm();
    if (difference > 1e-9) ++corrected;
    EXPECT_LT(difference, 0.05);
  }
  EXPECT_GT(corrected, 5);  // else this test has shown nothing
  EXPECT_LE(corrected, static_cast<int>(with_.graph().keyframes().size()));
}

TEST_F(FeedbackTest, TheNewestStateIsInTheGraphsWorld) {
  const Pose3 smoothed = with_.SmoothedTrajectory().back().pose;
  EXPECT_LT(BoxMinus(with_.newest()->state.T_world_body, smoothed).norm(), 1e-9);
  EXPECT_GT(BoxMinus(with_.T_world_odometry(), Pose3()).norm(), 1e-5);
  EXPECT_EQ(BoxMinus(without_.T_world_odometry(), Pose3()).norm(), 0.0);
}

TEST(Slam, MemoryIsBoundedWhileNoSweepIsOfUse) {
  Slam slam(SlamConfig{}, test::MakeTestRig());
  LidarSweep empty;
  empty.span = Duration::FromSeconds(kPeriod);
  const test::SwingMotion rest{.speed = 0.0};
  std::size_t most = 0;
  for (int k = 0; k < 6000; ++k) {  // ten minutes
    empty.stamp = kBegin + Duration::FromSeconds(k * kPeriod);
    slam.Process(empty);
    for (int i = 0; i < 20; ++i) slam.Process(rest.ImuAt(k * kPeriod + i * 0.005, kBegin, 9.81));
    most = std::max(most, slam.imu_samples());
  }
  slam.Finish();
  EXPECT_LE(most, 120U * 200U + 2U * 1024U);
  EXPECT_GT(slam.supervisor().streams().at("lidar").dropped.at("empty sweep"), 5900);
}

TEST(Slam, RefusesAConfigurationThatContradictsItself) {
  SlamConfig config;
  config.lio.registration.max_neighbor_distance = config.lio.registration.max_search_distance + 1.0;
  EXPECT_THROW(Slam(config, test::MakeTestRig()), ContractViolation);
}

}  // namespace
}  // namespace mlvi

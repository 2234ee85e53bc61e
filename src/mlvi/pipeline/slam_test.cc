// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/slam.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kPeriod = 0.1;

// Plays the furnished room from `from` to `to` (s), seen from a swinging body, to `slam`: sweeps
// before the samples that cover them, and stamped `early` (s) by the IMU's clock.
void Play(double from, double to, const test::SwingMotion& motion, Slam& slam, double early = 0.0) {
  const Rig rig = test::MakeTestRig();
  const test::BoxWorld world = test::FurnishedRoom();
  for (int k = static_cast<int>(std::lround(from / kPeriod)); (k + 1) * kPeriod <= to; ++k) {
    const double t = k * kPeriod;
    LidarSweep sweep =
        test::Scan(world, motion, *rig.lidar, t + early, kBegin, RandomStream(5).Fork(k));
    sweep.stamp = sweep.stamp - Duration::FromSeconds(early);
    slam.Process(sweep);
    for (const ImuSample& sample :
         test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(6))) {
      slam.Process(sample);
    }
  }
}

// Keyframes so often that several come out of the start, and a LiDAR trusted so little that the
// graph has something to correct.
SlamConfig CorrectingConfig(GraphFeedback feedback) {
  SlamConfig config;
  config.feedback = feedback;
  config.graph.keyframe_distance = 0.1;
  config.graph.map_position_sigma = 0.02;
  return config;
}

TEST(CheckRigTest, SaysWhatKeepsARigFromBeingUsed) {
  Rig rig = test::MakeTestRig();
  EXPECT_TRUE(CheckRig(SlamConfig(), rig).has_value());
  for (const double y : {0.0, 0.6}) {
    CameraSpec camera{.name = "left"};
    camera.T_body_camera = Pose3::FromTranslation({0.0, y, 0.0});
    rig.cameras.push_back(camera);
  }
  SlamConfig config;
  config.visual.vio.radius = 0.2;
  const Expected<void> outside = CheckRig(config, rig);
  ASSERT_FALSE(outside.has_value());
  EXPECT_EQ(outside.error().kind, ErrorKind::kConfiguration);
  EXPECT_NE(outside.error().message.find("a camera of rig"), std::string::npos);
  rig.lidar.reset();
  rig.cameras.clear();
  EXPECT_FALSE(CheckRig(SlamConfig(), rig).has_value());
}

class FeedbackTest : public ::testing::Test {
 protected:
  FeedbackTest() {
    for (Slam* slam : {&without_, &with_}) {
      Play(0.0, 5.0, {.speed = 1.5}, *slam);
      slam->Finish();
    }
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

double Distance(const Pose3& a, const Pose3& b) {
  return (a.translation() - b.translation()).norm();
}

// Poses are those of the LiDAR's instants under its own stamps, the current state is the IMU's.
TEST(Slam, FindsTheTimeOffsetOfTheLidar) {
  const test::SwingMotion motion{.speed = 1.5};
  for (const double early : {-0.01, 0.01}) {
    Slam slam(SlamConfig(), test::MakeTestRig());
    Play(0.0, 8.0, motion, slam, early);
    const StampedPose first = slam.odometry().front();
    const Pose3 T_world_truth =
        first.pose * motion.At((first.stamp - kBegin).seconds() + early).inverse();
    const auto truth = [&](Time imu) {
      return T_world_truth * motion.At((imu - kBegin).seconds());
    };
    EXPECT_LT(Distance(slam.current()->T_world_body, truth(slam.current()->stamp)), 0.006);
    slam.Finish();
    EXPECT_NEAR(slam.lidar_time_offset().seconds, early, 0.0005);
    // The last sweep of an early LiDAR ends behind the last sample: it is used all the same.
    ASSERT_EQ(slam.odometry().size(), 80U);
    const Duration offset = Duration::FromSeconds(early);
    for (const Trajectory& trajectory : {slam.odometry(), slam.SmoothedTrajectory()}) {
      const StampedPose& last = trajectory.back();
      EXPECT_LT(Distance(last.pose, truth(last.stamp + offset)), 0.006);
    }
    EXPECT_GT(slam.graph().keyframes().size(), 10U);
  }
}

TEST(Slam, ALossLeavesNoStateUntilTheNewStartAndAGapInTheGraph) {
  Slam slam(CorrectingConfig(GraphFeedback::kAlways), test::MakeTestRig());
  const test::SwingMotion motion{.speed = 1.5};
  Play(0.0, 2.5, motion, slam);
  ASSERT_TRUE(slam.current().has_value());
  const std::size_t keyframes = slam.graph().keyframes().size();
  Play(30.0, 30.5, motion, slam);
  EXPECT_FALSE(slam.current().has_value());
  EXPECT_EQ(slam.graph().keyframes().size(), keyframes);
  Play(30.5, 33.0, motion, slam);
  ASSERT_TRUE(slam.current().has_value());
  ASSERT_GT(slam.graph().keyframes().size(), keyframes + 3);
  EXPECT_EQ(slam.supervisor().odometry().resets.size(), 1U);
  EXPECT_FALSE(slam.supervisor().odometry().lost);
  // Smoothed over the second part alone: what the truth did since its first keyframe.
  const Keyframe& first = slam.graph().keyframes()[keyframes];
  const Keyframe& last = slam.graph().keyframes().back();
  EXPECT_GT((first.state.stamp - kBegin).seconds(), 30.0);
  const auto truth = [&](const Keyframe& k) {
    return motion.At((k.state.stamp - kBegin).seconds());
  };
  const Pose3 moved = slam.graph().Estimate(first.id).T_world_body.inverse() *
                      slam.graph().Estimate(last.id).T_world_body;
  EXPECT_LT(BoxMinus(moved, truth(first).inverse() * truth(last)).norm(), 0.03);
}

// How far `covariance` is from `expected`, in units of the latter: zero if they agree, at least 1
// if along any direction the one is twice the other, or the first is zero.
double Deviation(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& expected) {
  const Eigen::MatrixXd W =
      expected.llt().matrixL().solve(Eigen::MatrixXd::Identity(expected.rows(), expected.cols()));
  return (W * covariance * W.transpose() -
          Eigen::MatrixXd::Identity(expected.rows(), expected.cols()))
      .norm();
}

// What no error of the tilt of the map touches: the position along the line to the origin, about
// which the map tilts, and the heading. Rows on the position in the world and the rotation in the
// body.
Eigen::Matrix<double, 2, 6> UntiltedRows(const Pose3& T_world_body) {
  Eigen::Matrix<double, 2, 6> rows = Eigen::Matrix<double, 2, 6>::Zero();
  rows.block<1, 3>(0, 0) = T_world_body.translation().normalized().transpose();
  rows.block<1, 3>(1, 3) = T_world_body.R().row(2);
  return rows;
}

// Of the pose, position in the world and rotation in the body, that the last state of a start
// claims to have in the map.
Matrix6d PoseInMap(const OdometryEstimate& estimate) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = estimate.state.T_world_body.R();
  return J * estimate.map->covariance * J.transpose();
}

Matrix6d PoseBlock(const Matrix15d& covariance) {
  const std::array<int, 6> pose = {0, 1, 2, 6, 7, 8};  // p, v, R, ...
  return covariance(pose, pose);
}

TEST(Slam, TheGraphBeginsWithTheLastStateOfAStart) {
  Slam slam(CorrectingConfig(GraphFeedback::kNever), test::MakeTestRig());
  const test::SwingMotion motion{.speed = 1.5};
  int k = 0;  // sweeps; half of one more, as ends are not exact
  for (; slam.graph().keyframes().empty() && k < 50; ++k)
    Play(k * kPeriod, (k + 1.5) * kPeriod, motion, slam);
  const std::size_t of_the_start = slam.graph().keyframes().size();
  ASSERT_GT(of_the_start, 3U);
  EXPECT_EQ(slam.graph().keyframes().back().state.stamp, slam.odometry().back().stamp);
  // The graph takes over what the start says of its last state, but for the floor of the prior.
  const GraphUpdate begin = *slam.graph().newest();
  const OdometryEstimate& last = *slam.newest();
  Matrix15d claimed = last.covariance;
  claimed.diagonal().head<3>().array() += 1e-8;
  claimed.diagonal().segment<3>(nav_index::kRotation).array() += 1e-8;
  EXPECT_LT(Deviation(begin.covariance, claimed), 1e-4);
  // And that is its place in the map, once.
  const Eigen::Matrix<double, 2, 6> rows = UntiltedRows(last.state.T_world_body);
  const Matrix6d in_map = PoseInMap(last) + 1e-8 * Matrix6d::Identity();
  EXPECT_LT(Deviation(rows * PoseBlock(begin.covariance) * rows.transpose(),
                      rows * in_map * rows.transpose()),
            1e-4);
  Play(k * kPeriod, (k + 10.5) * kPeriod, motion, slam);
  slam.Finish();
  EXPECT_TRUE(slam.graph().converged());
  const Trajectory smoothed = slam.SmoothedTrajectory();
  ASSERT_EQ(smoothed.size(), slam.odometry().size());
  for (std::size_t i = 0; i < smoothed.size(); ++i) {
    EXPECT_EQ(smoothed[i].stamp, slam.odometry()[i].stamp);
    EXPECT_LT(BoxMinus(smoothed[i].pose, slam.odometry()[i].pose).norm(), 0.05);
  }
  for (std::size_t i = 1; i < slam.graph().keyframes().size(); ++i) {
    EXPECT_LT(slam.graph().keyframes()[i - 1].state.stamp, slam.graph().keyframes()[i].state.stamp);
  }
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

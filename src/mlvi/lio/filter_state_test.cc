// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/filter_state.h"

#include <gtest/gtest.h>

#include "mlvi/imu/preintegration.h"
#include "mlvi/lio/motion_guess.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kGravity = 9.81;

class FilterStateTest : public ::testing::Test {
 protected:
  FilterStateTest()
      : samples_(test::ImuRun(motion_, rig_, 0.4, 0.8, kBegin, RandomStream(1), false)) {
    start_.mean.nav = motion_.StateAt(0.5, kBegin);
    start_.covariance = FilterMatrix::Identity() * 1e-4;
  }
  // Over 0.2 s of the LiDAR's clock.
  Prediction From(const FilterState& state) const {
    const Duration offset = Duration::FromSeconds(state.time_offset);
    const Time begin = kBegin + Duration::FromMilliseconds(500) + offset;
    std::vector<ImuSample> samples =
        SamplesBetween(samples_, begin, begin + Duration::FromMilliseconds(200));
    for (ImuSample& sample : samples) sample.stamp = sample.stamp - offset;
    return Predict({state, start_.covariance}, samples, rig_.imu, kGravity);
  }

  test::SwingMotion motion_{.speed = 2.0};
  Rig rig_ = test::MakeTestRig();
  std::vector<ImuSample> samples_;
  StateEstimate start_;
};

TEST_F(FilterStateTest, PredictsTheMotion) {
  const NavState end = From(start_.mean).end.mean.nav;
  const NavState truth = motion_.StateAt(0.7, kBegin);
  EXPECT_LT((end.T_world_body.translation() - truth.T_world_body.translation()).norm(), 1e-4);
  EXPECT_LT((end.v_world_body - truth.v_world_body).norm(), 1e-3);
}

TEST_F(FilterStateTest, TransitionIsTheDerivativeOfThePrediction) {
  start_.mean.tilt = {0.02, -0.03};
  const Prediction prediction = From(start_.mean);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kTimeOffset; ++i) {
    const FilterVector step = FilterVector::Unit(i) * kStep;
    const FilterState plus = From(BoxPlus(start_.mean, step)).end.mean;
    const FilterState minus = From(BoxPlus(start_.mean, -step)).end.mean;
    const FilterVector numeric =
        (BoxMinus(plus, prediction.end.mean) - BoxMinus(minus, prediction.end.mean)) /
        (2.0 * kStep);
    // The tilt is treated to first order: its square (1e-3) times g dt is left out.
    const double tolerance = i < kTilt ? 2e-4 : 1e-3 * kGravity * 0.2;
    EXPECT_LT((numeric - prediction.transition.col(i)).cwiseAbs().maxCoeff(), tolerance)
        << "column " << i;
  }
}

TEST_F(FilterStateTest, AShiftedClockMovesBothEndsOfTheWay) {
  start_.mean.nav.bias = {.accelerometer = {0.1, -0.05, 0.2}, .gyroscope = {0.2, -0.1, 0.3}};
  start_.mean.tilt = {0.2, -0.3};
  const Prediction prediction = From(start_.mean);
  constexpr double kStep = 1e-3;
  FilterState plus = start_.mean, minus = start_.mean;
  plus.time_offset = kStep;
  minus.time_offset = -kStep;
  const FilterVector numeric = (BoxMinus(From(plus).end.mean, prediction.end.mean) -
                                BoxMinus(From(minus).end.mean, prediction.end.mean)) /
                               (2.0 * kStep);
  // Samples of the end that rate and force are taken from differ by a period's change.
  EXPECT_LT((numeric - prediction.transition.col(kTimeOffset)).norm(), 0.02);
  EXPECT_GT(numeric.segment<3>(nav_index::kRotation).norm(), 0.5);
  EXPECT_EQ(prediction.transition(kTimeOffset, kTimeOffset), 1.0);
}

TEST_F(FilterStateTest, ATiltedWorldPredictsTheSameMotionTilted) {
  const Eigen::Quaterniond tilt = ExpSo3(Eigen::Vector3d(0.05, -0.04, 0.0));
  FilterState tilted = start_.mean;
  tilted.tilt = {0.05, -0.04};
  tilted.nav.T_world_body = Pose3(tilt, Eigen::Vector3d::Zero()) * tilted.nav.T_world_body;
  tilted.nav.v_world_body = tilt * tilted.nav.v_world_body;
  const NavState level_end = From(start_.mean).end.mean.nav;
  const NavState tilted_end = From(tilted).end.mean.nav;
  EXPECT_LT((tilted_end.v_world_body - tilt * level_end.v_world_body).norm(), 1e-12);
  EXPECT_LT(
      (tilted_end.T_world_body.translation() - tilt * level_end.T_world_body.translation()).norm(),
      1e-12);
}

TEST_F(FilterStateTest, AnchoringMovesRollAndPitchIntoTheTilt) {
  Matrix15d covariance = Matrix15d::Zero();
  covariance.block<3, 3>(6, 6) = Eigen::Matrix3d::Identity() * 4e-4;
  const StateEstimate anchored =
      AnchorToMap(start_.mean.nav, covariance, {.seconds = 0.001, .sigma = 0.002});
  EXPECT_NEAR(anchored.covariance(kTilt, kTilt), 4e-4, 1e-12);
  EXPECT_EQ(TimeOffsetOf(anchored).seconds, 0.001);
  EXPECT_NEAR(TimeOffsetOf(anchored).sigma, 0.002, 1e-15);
  EXPECT_LT((anchored.covariance.block<3, 3>(6, 6).trace()), 2e-5);
  // And back: the reported attitude is as uncertain about roll and pitch as it was.
  const Matrix15d reported = ReportedCovariance(anchored, Matrix6d::Zero());
  const Eigen::Matrix3d R = start_.mean.nav.T_world_body.R();
  const Eigen::Matrix3d world = R * reported.block<3, 3>(6, 6) * R.transpose();
  EXPECT_NEAR(world(0, 0), 4e-4, 1e-5);
  EXPECT_NEAR(world(1, 1), 4e-4, 1e-5);
}

Matrix6d RandomCovariance(RandomStream& random) {
  Matrix6d factor;
  for (int i = 0; i < 36; ++i) factor(i) = random.Normal();
  return factor * factor.transpose();
}

// Against the definition: displace map and body together at the one pose, see where the body comes
// to lie at the other.
TEST(GrownDrift, IsWhatADisplacedMapDoesToALaterPose) {
  RandomStream random(1);
  const Pose3 from(ExpSo3({0.3, -0.2, 1.1}), {12.0, -7.0, 1.0});
  StateEstimate to;
  to.mean.nav.T_world_body = Pose3(ExpSo3({-0.4, 0.1, -0.6}), {15.0, -2.0, 1.5});
  const Pose3& T = to.mean.nav.T_world_body;
  Matrix6d J;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = kStep * Vector6d::Unit(i);  // world position, body rotation
    const Pose3 displaced(from.rotation() * ExpSo3(d.tail<3>()), from.translation() + d.head<3>());
    const Pose3 moved = displaced * from.inverse() * T;
    J.col(i) << (moved.translation() - T.translation()) / kStep,
        LogSo3(T.rotation().conjugate() * moved.rotation()) / kStep;
  }
  const Matrix6d drift = RandomCovariance(random), registration = RandomCovariance(random);
  AddPoseCovariance(registration, to.covariance);
  const Matrix6d expected = J * drift * J.transpose() + 0.3 * registration;
  EXPECT_LT((GrownDrift(drift, from, to, 0.3) - expected).norm(), 1e-4 * expected.norm());
}

// Against the definition: turn the world until its z axis is that of gravity, about its origin.
TEST_F(FilterStateTest, TheReportCountsTheTiltAsATurnOfTheWorld) {
  start_.mean.nav.T_world_body = Pose3(ExpSo3({0.3, -0.2, 1.1}), {12.0, -7.0, 1.0});
  start_.mean.nav.v_world_body = {1.5, -0.5, 0.2};
  const NavState& nav = start_.mean.nav;
  Eigen::Matrix<double, 15, 2> J;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d tilt = kStep * Eigen::Vector2d::Unit(i);
    const Eigen::Quaterniond R_level_world = ExpSo3({-tilt.x(), -tilt.y(), 0.0});
    NavState level = nav;
    level.T_world_body = Pose3(R_level_world, Eigen::Vector3d::Zero()) * nav.T_world_body;
    level.v_world_body = R_level_world * nav.v_world_body;
    J.col(i) = BoxMinus(level, nav) / kStep;
  }
  const Eigen::Matrix2d tilt = (Eigen::Matrix2d() << 4e-4, 1e-4, 1e-4, 2e-4).finished();
  start_.covariance.setZero();
  start_.covariance.block<2, 2>(kTilt, kTilt) = tilt;
  const Matrix15d expected = J * tilt * J.transpose();
  const Matrix15d reported = ReportedCovariance(start_, Matrix6d::Zero());
  EXPECT_LT((reported - expected).norm(), 1e-4 * expected.norm());
}

TEST_F(FilterStateTest, APreciseMotionGuessDecidesTheRelativePose) {
  start_.mean.nav.v_world_body +=
      Eigen::Vector3d(0.1, -0.2, 0.05);  // so that the IMU predicts a wrong motion
  start_.covariance.diagonal().segment<3>(3).setConstant(0.04);
  const Prediction prediction = From(start_.mean);
  const Pose3 truth = motion_.At(0.5).inverse() * motion_.At(0.7);
  const MotionPrior guess{.from = kBegin + Duration::FromMilliseconds(500),
                          .to = kBegin + Duration::FromMilliseconds(700),
                          .T_from_to = truth,
                          .covariance = Matrix6d::Identity() * 1e-8};
  const StateEstimate fused = FuseMotionGuess(start_, prediction, guess);
  const Eigen::Vector3d error =
      fused.mean.nav.T_world_body.translation() - motion_.At(0.7).translation();
  EXPECT_GT(
      (prediction.end.mean.nav.T_world_body.translation() - motion_.At(0.7).translation()).norm(),
      0.03);
  EXPECT_LT(error.norm(), 2e-3);
  // The velocity follows through its correlation with the position.
  EXPECT_LT((fused.mean.nav.v_world_body - motion_.StateAt(0.7, kBegin).v_world_body).norm(), 0.02);
  EXPECT_LT(fused.covariance.trace(), prediction.end.covariance.trace());
}

}  // namespace
}  // namespace mlvi

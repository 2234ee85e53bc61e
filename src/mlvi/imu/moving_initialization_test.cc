// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <numbers>

#include "mlvi/imu/imu_testing.h"
#include "mlvi/imu/initialization.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/imu/pose_alignment.h"

namespace mlvi {
namespace {

using testing::AddImuNoise;
using testing::kGravity;
using testing::NormalVector;
using testing::TestImu;
using testing::Walk;

// What a moving start gets, and the truth in the world that it defines.
struct Scenario {
  std::vector<TimedPose> poses;
  std::vector<ImuSample> samples;
  std::vector<NavState> truth;
};

struct Noise {
  double position = 0.02;   // m, per axis and step
  double rotation = 0.004;  // rad
};

// `count` poses at `rate_hz` from `from` on, their steps disturbed by `noise`, in an arbitrary
// frame.
Scenario MakeScenario(const Walk& walk, const ImuSpec& imu, int count, double rate_hz, double from,
                      const Noise& noise, RandomStream& random) {
  Scenario scenario;
  const double to = from + (count - 1) / rate_hz;
  scenario.samples = walk.Samples(from, to, imu.rate_hz);
  const ImuBias first_bias{
      .accelerometer = NormalVector(random, imu.initial_accelerometer_bias_sigma),
      .gyroscope = NormalVector(random, imu.initial_gyroscope_bias_sigma)};
  const ImuBias last_bias = AddImuNoise(imu, first_bias, random, scenario.samples);

  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(noise.position), Eigen::Vector3d::Constant(noise.rotation);
  Pose3 pose(ExpSo3(NormalVector(random, 2.0)), NormalVector(random, 10.0));
  const Pose3 T_walk_first = walk.State(from).T_world_body;
  const Eigen::Vector3d up = T_walk_first.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  const double heading = Heading(up).Of(T_walk_first.R());
  const Pose3 T_world_walk = Pose3(ExpSo3({0.0, 0.0, -heading}), Eigen::Vector3d::Zero()) *
                             Pose3::FromTranslation(-T_walk_first.translation());
  for (int k = 0; k < count; ++k) {
    NavState state = walk.State(from + k / rate_hz);
    if (k > 0) {
      const Pose3 step =
          walk.State(from + (k - 1) / rate_hz).T_world_body.inverse() * state.T_world_body;
      Vector6d error;
      for (int i = 0; i < 6; ++i) error(i) = sigma(i) * random.Normal();
      pose = pose * BoxPlus(step, error);
    }
    scenario.poses.push_back({state.stamp, pose, sigma.cwiseAbs2().asDiagonal()});
    state.T_world_body = T_world_walk * state.T_world_body;
    state.v_world_body = T_world_walk.rotation() * state.v_world_body;
    state.bias = k + 1 == count ? last_bias : first_bias;
    scenario.truth.push_back(state);
  }
  return scenario;
}

double DegreesBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

double TiltError(const NavState& state, const NavState& truth) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  return DegreesBetween(state.T_world_body.rotation().conjugate() * up,
                        truth.T_world_body.rotation().conjugate() * up);
}

TEST(MovingInitializationTest, RecoversTheStateExactlyWithoutNoise) {
  ImuSpec imu = TestImu();
  imu.rate_hz = 2000.0;
  RandomStream random(1, "exact");
  Scenario scenario = MakeScenario(Walk(), imu, 6, 2.0, 0.0, {0.0, 0.0}, random);
  scenario.samples = Walk().Samples(0.0, 2.5, imu.rate_hz);
  for (TimedPose& pose : scenario.poses) pose.covariance = 1e-4 * Matrix6d::Identity();
  const auto start = InitializeFromPoses(scenario.poses, scenario.samples, imu, kGravity);
  ASSERT_TRUE(start.has_value()) << start.error().message;
  ASSERT_EQ(start->states.size(), scenario.poses.size());
  ASSERT_EQ(start->relative.size(), scenario.poses.size());
  EXPECT_EQ(start->relative.back().norm(), 0.0);
  for (std::size_t k = 0; k < start->states.size(); ++k) {
    scenario.truth[k].bias = ImuBias();
    const Vector15d error = BoxMinus(start->states[k], scenario.truth[k]);
    EXPECT_LT(error.norm(), 1e-4) << "state " << k;  // integration error at 2 kHz
    EXPECT_EQ(start->states[k].stamp, scenario.poses[k].stamp);
  }
  EXPECT_EQ(start->method, "moving");
  EXPECT_LT(start->rms_residual, 0.1);
}

// What many starts of the walk came to; each from six poses over 2.5 s.
struct MonteCarlo {
  double nees = 0.0, chi_square = 0.0;              // means
  double relative_nees = 0.0;                       // of the first pose as seen from the last
  double rms_tilt = 0.0, worst_tilt = 0.0;          // degrees
  double rms_velocity = 0.0, worst_velocity = 0.0;  // m/s
  static constexpr int kTrials = 200, kDegreesOfFreedom = 6 * 6 - 11;
};

// `claimed` is what the poses' covariance says of their sigma, as a share of the truth.
MonteCarlo StartManyTimes(const ImuSpec& imu, const Noise& noise, double claimed = 1.0) {
  MonteCarlo result;
  RandomStream random(2, "moving");
  for (int trial = 0; trial < MonteCarlo::kTrials; ++trial) {
    Scenario scenario = MakeScenario(Walk(), imu, 6, 2.0, 0.17 * trial, noise, random);
    for (TimedPose& pose : scenario.poses) pose.covariance *= claimed * claimed;
    const auto start = InitializeFromPoses(scenario.poses, scenario.samples, imu, kGravity);
    if (!start.has_value()) {
      ADD_FAILURE() << start.error().message;
      return result;
    }
    const Vector15d error = BoxMinus(scenario.truth.back(), start->states.back());
    const double tilt = TiltError(start->states.back(), scenario.truth.back());
    const double velocity = error.segment<3>(nav_index::kVelocity).norm();
    result.nees += error.dot(start->covariance.llt().solve(error)) / MonteCarlo::kTrials;
    const auto seen = [](const std::vector<NavState>& states) {
      return states.back().T_world_body.inverse() * states.front().T_world_body;
    };
    const Vector6d relative = BoxMinus(seen(scenario.truth), seen(start->states));
    result.relative_nees +=
        relative.dot(start->relative.front().llt().solve(relative)) / MonteCarlo::kTrials;
    result.chi_square += start->rms_residual * start->rms_residual / MonteCarlo::kTrials;
    result.rms_tilt += tilt * tilt / MonteCarlo::kTrials;
    result.rms_velocity += velocity * velocity / MonteCarlo::kTrials;
    result.worst_tilt = std::max(result.worst_tilt, tilt);
    result.worst_velocity = std::max(result.worst_velocity, velocity);
  }
  result.rms_tilt = std::sqrt(result.rms_tilt);
  result.rms_velocity = std::sqrt(result.rms_velocity);
  return result;
}

void ExpectConsistent(const MonteCarlo& result) {
  const double nees_sigma = std::sqrt(2.0 * 15.0 / MonteCarlo::kTrials);
  EXPECT_NEAR(result.chi_square, 1.0,
              4.0 * std::sqrt(2.0 / (MonteCarlo::kDegreesOfFreedom * MonteCarlo::kTrials)));
  EXPECT_LT(result.nees, 15.0 + 4.0 * nees_sigma);
  // A residual above one widens the covariance, one below does not narrow it. With z a normal
  // variable and sigma = sqrt(2 / 25) that of the reduced chi square, the mean of 1 / max(1, 1 +
  // sigma z) is about 1 - 0.4 sigma = 0.89.
  EXPECT_GT(result.nees, 0.89 * 15.0 - 4.0 * nees_sigma);
  const double relative_sigma = std::sqrt(2.0 * 6.0 / MonteCarlo::kTrials);
  EXPECT_LT(result.relative_nees, 6.0 + 4.0 * relative_sigma);
  EXPECT_GT(result.relative_nees, 0.89 * 6.0 - 4.0 * relative_sigma);
}

// An accelerometer of the usual grade and registrations to a centimetre.
TEST(MovingInitializationTest, MeetsTheAccuracyAskedFor) {
  ImuSpec imu = TestImu();
  imu.initial_accelerometer_bias_sigma = 0.03;
  const MonteCarlo result = StartManyTimes(imu, {.position = 0.01, .rotation = 0.003});
  ExpectConsistent(result);
  EXPECT_LT(result.worst_tilt, 1.0);
  EXPECT_LT(result.worst_velocity, 0.1);
}

// A bias of 0.1 m/s^2 passes for a tilt of 0.58 degrees on each axis as long as the body does not
// turn over: no estimator can do much better than sqrt(2) times that, and this one must not do
// worse.
TEST(MovingInitializationTest, LargeBiasesAndNoiseCostAccuracyButNotConsistency) {
  const MonteCarlo result = StartManyTimes(TestImu(), {.position = 0.02, .rotation = 0.004});
  ExpectConsistent(result);
  EXPECT_LT(result.rms_tilt, std::sqrt(2.0) * 0.58);
  EXPECT_LT(result.rms_velocity, 0.1);
}

// The normal equations of a registration with thousands of points promise far more than it keeps.
TEST(MovingInitializationTest, OverconfidentPosesDoNoHarm) {
  ImuSpec imu = TestImu();
  imu.initial_accelerometer_bias_sigma = 0.03;
  const MonteCarlo result = StartManyTimes(imu, {.position = 0.01, .rotation = 0.003}, 0.1);
  EXPECT_LT(result.nees, 15.0 + 4.0 * std::sqrt(2.0 * 15.0 / MonteCarlo::kTrials));
  EXPECT_LT(result.worst_tilt, 1.0);
  EXPECT_LT(result.worst_velocity, 0.1);
}

// Few poses over a short time, many over a long one, both mounts, calm and fast turns.
TEST(MovingInitializationTest, WorksOverTheRangeOfMotions) {
  ImuSpec imu = TestImu();
  imu.initial_accelerometer_bias_sigma = 0.03;
  RandomStream random(4, "range");
  for (const double yaw_rate : {0.0, 0.4, -0.7, 1.5}) {
    for (const int count : {4, 5, 8}) {
      for (const bool z_down : {true, false}) {
        Walk walk;
        walk.yaw_rate = yaw_rate;
        if (!z_down) walk.mount.setIdentity();
        const Scenario scenario =
            MakeScenario(walk, imu, count, 2.0, 0.3 * count, {0.01, 0.003}, random);
        const auto start = InitializeFromPoses(scenario.poses, scenario.samples, imu, kGravity);
        ASSERT_TRUE(start.has_value()) << start.error().message;
        for (std::size_t k = 0; k < start->states.size(); ++k) {
          EXPECT_LT(TiltError(start->states[k], scenario.truth[k]), 1.0);
          EXPECT_LT((start->states[k].v_world_body - scenario.truth[k].v_world_body).norm(), 0.1);
        }
      }
    }
  }
}

TEST(MovingInitializationTest, SurvivesAnImuGap) {
  RandomStream random(6, "gap");
  Scenario scenario = MakeScenario(Walk(), TestImu(), 8, 2.0, 0.0, {0.01, 0.003}, random);
  std::erase_if(scenario.samples, [](const ImuSample& sample) {
    const double t = Walk::Seconds(sample.stamp);
    return t > 1.6 && t < 1.95;
  });
  const auto start = InitializeFromPoses(scenario.poses, scenario.samples, TestImu(), kGravity);
  ASSERT_TRUE(start.has_value()) << start.error().message;
  EXPECT_LT(TiltError(start->states.back(), scenario.truth.back()), 1.0);
  EXPECT_LT((start->states.back().v_world_body - scenario.truth.back().v_world_body).norm(), 0.1);
}

// The message of the error; fails the test when there is none.
std::string Failure(const Scenario& scenario, double gravity = kGravity) {
  const auto start = InitializeFromPoses(scenario.poses, scenario.samples, TestImu(), gravity);
  EXPECT_FALSE(start.has_value()) << "residual " << start->rms_residual;
  return start.has_value() ? std::string() : start.error().message;
}

Scenario PlainScenario() {
  RandomStream random(8, "plain");
  return MakeScenario(Walk(), TestImu(), 6, 2.0, 0.0, {0.01, 0.003}, random);
}

TEST(MovingInitializationTest, ContradictionsAreErrors) {
  // The IMU turned by 90 degrees about each axis against what the extrinsics say.
  for (int axis = 0; axis < 3; ++axis) {
    Scenario turned = PlainScenario();
    const Eigen::Quaterniond R = ExpSo3(0.5 * std::numbers::pi * Eigen::Vector3d::Unit(axis));
    for (ImuSample& sample : turned.samples) {
      sample.angular_velocity = R * sample.angular_velocity;
      sample.linear_acceleration = R * sample.linear_acceleration;
    }
    EXPECT_THAT(Failure(turned), ::testing::HasSubstr("contradict")) << "axis " << axis;
  }
  EXPECT_THAT(Failure(PlainScenario(), 1.0), ::testing::HasSubstr("gravity"));
  EXPECT_THAT(Failure(PlainScenario(), 3.7), ::testing::HasSubstr("gravity"));
  Scenario late = PlainScenario();
  for (ImuSample& sample : late.samples)
    sample.stamp = sample.stamp + Duration::FromMilliseconds(150);
  EXPECT_THAT(Failure(late), ::testing::HasSubstr("time offset"));
  Scenario jump = PlainScenario();
  jump.poses[3].T_start_body = jump.poses[3].T_start_body * Pose3::FromTranslation({0.5, 0.0, 0.0});
  EXPECT_THAT(Failure(jump), ::testing::HasSubstr("contradict"));
}

TEST(MovingInitializationTest, InsufficientInputIsAnError) {
  Scenario few = PlainScenario();
  few.poses.resize(3);
  EXPECT_THAT(Failure(few), ::testing::HasSubstr("4 poses"));
  Scenario uncovered = PlainScenario();
  uncovered.samples.resize(uncovered.samples.size() / 2);
  EXPECT_THAT(Failure(uncovered), ::testing::HasSubstr("uncovered"));
  Scenario empty = PlainScenario();
  empty.samples.clear();
  EXPECT_THAT(Failure(empty), ::testing::HasSubstr("no IMU samples"));
  RandomStream random(8, "short");
  EXPECT_THAT(Failure(MakeScenario(Walk(), TestImu(), 6, 10.0, 0.0, Noise(), random)),
              ::testing::HasSubstr("over 1.0 s"));
}

TEST(MovingInitializationTest, TwoRunsAreIdentical) {
  const Scenario scenario = PlainScenario();
  const auto a = InitializeFromPoses(scenario.poses, scenario.samples, TestImu(), kGravity);
  const auto b = InitializeFromPoses(scenario.poses, scenario.samples, TestImu(), kGravity);
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ(a->covariance, b->covariance);
  EXPECT_EQ(a->states.back().v_world_body, b->states.back().v_world_body);
}

}  // namespace
}  // namespace mlvi

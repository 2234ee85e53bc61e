// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/start.h"

#include <gtest/gtest.h>

#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kPeriod = 0.1;

// Somebody who stands, but turns slowly.
struct SlowTurn {
  double rate = 0.02;  // rad/s

  Pose3 At(double t) const {
    return Pose3(ExpSo3(Eigen::Vector3d(0.0, 0.0, rate * t)), Eigen::Vector3d::Zero());
  }
  ImuSample ImuAt(double t, Time begin, double gravity) const {
    ImuSample sample;
    sample.stamp = begin + Duration::FromSeconds(t);
    sample.angular_velocity = {0.0, 0.0, rate};
    sample.linear_acceleration = {0.0, 0.0, gravity};
    return sample;
  }
};

TEST(Start, ASlowTurnIsNotTakenForABiasOfTheGyroscope) {
  Rig rig = test::MakeTestRig();
  rig.imu.initial_gyroscope_bias_sigma = 0.01;
  const LioConfig config;
  const SlowTurn motion;
  Start start(config, rig);
  std::optional<StartResult> result;
  for (int k = 0; k < 20 && !result; ++k) {
    const double t = k * kPeriod;
    result = start.Add(
        test::Scan(test::FurnishedRoom(), motion, *rig.lidar, t, kBegin, RandomStream(3).Fork(k)),
        test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(4)));
  }
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->method, "static");
  const Eigen::Vector3d bias = result->states.back().bias.gyroscope;
  const double sigma = std::sqrt(result->covariance(14, 14));
  EXPECT_LT(sigma, 0.5 * motion.rate);  // tells the two apart
  EXPECT_LT(bias.norm(), 4.0 * sigma);  // three components
  const Eigen::Quaterniond turned = result->states.front().T_world_body.rotation().conjugate() *
                                    result->states.back().T_world_body.rotation();
  const double seconds = (result->states.back().stamp - result->states.front().stamp).seconds();
  EXPECT_NEAR(LogSo3(turned).z(), motion.rate * seconds, 0.003);  // of 0.008
}

// The first states of somebody who moves, given by `motion`.
template <typename Motion>
std::optional<StartResult> StartOf(const Motion& motion, const Rig& rig,
                                   const test::BoxWorld& world, const LioConfig& config = {}) {
  Start start(config, rig);
  std::optional<StartResult> result;
  for (int k = 0; k < 20 && !result; ++k) {
    const double t = k * kPeriod;
    result = start.Add(test::Scan(world, motion, *rig.lidar, t, kBegin, RandomStream(3).Fork(k)),
                       test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(4)));
  }
  return result;
}

TEST(Start, ASmoothDriveIsNotTakenForRest) {
  const test::SteadyMotion motion{.velocity = {0.08, 0.02, 0.0}, .rate = Eigen::Vector3d::Zero()};
  const auto result = StartOf(motion, test::MakeTestRig(), test::FurnishedRoom());
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->method, "static");  // all that the IMU can tell
  // The start defines heading and origin: the body's heading was 0.
  const Eigen::Vector3d error = result->states.back().v_world_body - motion.velocity;
  const double sigma = std::sqrt(result->covariance(3, 3));
  EXPECT_LT(sigma, 0.03);
  EXPECT_LT(error.norm(), 3.0 * sigma);
  EXPECT_LT(error.norm(), 0.03);  // of 0.08
}

TEST(Start, IsLevelAtTheEndOfASlowRoll) {
  const test::SteadyMotion motion{.velocity = Eigen::Vector3d::Zero(), .rate = {0.03, 0.0, 0.0}};
  const auto result = StartOf(motion, test::MakeTestRig(), test::FurnishedRoom());
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->method, "static");
  for (const NavState& state : result->states) {
    const Eigen::Matrix3d truth = motion.At((state.stamp - kBegin).seconds()).R();
    const Eigen::Vector3d up = state.T_world_body.R().row(2), true_up = truth.row(2);
    // The mean attitude would be 8 mrad off at the end; registered turns are good to 1 mrad.
    EXPECT_LT((up - true_up).norm(), 0.003);
  }
}

TEST(Start, TellsWhichDirectionsItsSweepsDidNotSee) {
  Rig rig = test::MakeTestRig();
  rig.lidar->max_range = 20.0;
  const test::SteadyMotion motion{.velocity = Eigen::Vector3d::Zero(),
                                  .rate = Eigen::Vector3d::Zero()};
  LioConfig config;
  // Bad fits in the map of one sweep seem to tell the axis.
  config.degeneracy.max_noise_share = 0.05;
  config.degeneracy.min_facing_count = 10000;
  const auto blind = StartOf(motion, rig, test::EndlessCorridor(), config);
  ASSERT_TRUE(blind.has_value());
  ASSERT_EQ(blind->degeneracies.size(), blind->states.size());
  for (std::size_t i = 1; i < blind->degeneracies.size(); ++i) {
    ASSERT_EQ(blind->degeneracies[i].translation_directions, 1);
    EXPECT_GT(std::abs(blind->degeneracies[i].translation_axes(0, 0)), 0.99);
  }
  const auto seeing = StartOf(motion, rig, test::FurnishedRoom());
  ASSERT_TRUE(seeing.has_value());
  const Matrix6d best = StartInformation();
  for (const Degeneracy& degeneracy : seeing->degeneracies) {
    EXPECT_FALSE(degeneracy.any());
    const Vector6d told = degeneracy.information.diagonal().cwiseQuotient(best.diagonal());
    EXPECT_GT(told.minCoeff(), 0.5);
    EXPECT_LE(told.maxCoeff(), 1.0);
  }
}

TEST(Start, TellsItsEarlierPosesAsSeenFromTheLast) {
  const test::SteadyMotion still{.velocity = {0.02, 0.0, 0.0}, .rate = {0.0, 0.0, 0.02}},
      walk{.velocity = {1.2, 0.3, 0.0}, .rate = {0.0, 0.0, 0.3}};
  for (const auto& [motion, method] : {std::pair(still, "static"), std::pair(walk, "moving")}) {
    const auto result = StartOf(motion, test::MakeTestRig(), test::FurnishedRoom());
    ASSERT_TRUE(result.has_value());
    ASSERT_EQ(result->method, method);
    ASSERT_EQ(result->relative.size(), result->states.size());
    const auto at = [&](const NavState& state) {
      return motion.At((state.stamp - kBegin).seconds());
    };
    const NavState& last = result->states.back();
    for (std::size_t k = 0; k + 1 < result->states.size(); ++k) {
      const NavState& state = result->states[k];
      const Vector6d error = BoxMinus(last.T_world_body.inverse() * state.T_world_body,
                                      at(last).inverse() * at(state));
      const Matrix6d& covariance = result->relative[k];
      EXPECT_LT(error.dot(covariance.llt().solve(error)), 22.5) << method << k;  // 0.1 % of chi^2_6
      EXPECT_LT(std::sqrt(covariance.diagonal().maxCoeff()), 0.1);
    }
  }
}

// Somebody who stands still, and whose sweep was taken from elsewhere: the error of its
// registration.
struct Displaced {
  Pose3 T_true_seen;

  Pose3 At(double /*t*/) const { return T_true_seen; }
};

// A start at rest from sweeps without duration, each but the first of which lies beside the body by
// an error of the covariance that a start claims at best.
std::optional<StartResult> StartFromDisplacedSweeps(std::uint64_t seed) {
  const Rig rig = test::MakeTestRig();
  const LioConfig config;
  const test::ScanPattern sparse{.rings = 16, .columns = 180, .span = 0.0};
  const Vector6d sigma = StartInformation().diagonal().cwiseSqrt().cwiseInverse();
  RandomStream errors(seed, "registration");
  Start start(config, rig);
  std::optional<StartResult> result;
  for (int k = 0; k < 20 && !result; ++k) {
    Displaced from;
    if (k > 0) {
      Vector6d error;
      for (int i = 0; i < 6; ++i) error[i] = sigma[i] * errors.Normal();
      from.T_true_seen = BoxPlus(Pose3(), error);
    }
    const double t = (k + 1) * kPeriod;
    result = start.Add(
        test::Scan(test::FurnishedRoom(), from, *rig.lidar, t, kBegin, RandomStream(seed).Fork(k),
                   sparse),
        test::ImuRun(test::SteadyMotion{}, rig, t - kPeriod, t, kBegin, RandomStream(seed, "imu")));
  }
  return result;
}

// Normalised error squared of state k of a start at rest, as seen from the last one.
double NeesAtRest(const StartResult& start, std::size_t k) {
  const Pose3 T_last_k = start.states.back().T_world_body.inverse() * start.states[k].T_world_body;
  const Vector6d error = BoxMinus(T_last_k, Pose3());
  return error.dot(start.relative[k].llt().solve(error));
}

TEST(Start, AtRestEachSweepBringsItsOwnErrorButTheFirst) {
  constexpr int kTrials = 50;
  double first = 0.0, second = 0.0;  // means
  for (int seed = 0; seed < kTrials; ++seed) {
    const auto start = StartFromDisplacedSweeps(seed);
    ASSERT_TRUE(start.has_value());
    ASSERT_EQ(start->method, "static");
    ASSERT_GT(start->states.size(), 2U);
    EXPECT_EQ(start->relative.back().norm(), 0.0);
    first += NeesAtRest(*start, 0) / kTrials;
    second += NeesAtRest(*start, 1) / kTrials;
  }
  const double sigma = std::sqrt(2.0 * 6.0 / kTrials);
  EXPECT_NEAR(first, 6.0, 4.0 * sigma);
  EXPECT_NEAR(second, 6.0, 4.0 * sigma);
}

TEST(GyroTrajectory, IsTheSteadyMotionThatItsAnchorLiesOn) {
  const Rig rig = test::MakeTestRig();
  const test::SteadyMotion motion{.velocity = {1.6, -1.0, 0.4}, .rate = {0.5, -1.0, 2.0}};
  const std::vector<ImuSample> samples =
      test::ImuRun(motion, rig, 0.3, 0.4, kBegin, RandomStream(1), false);
  for (const double at : {0.3, 0.3517, 0.4}) {
    const NavState anchor{.stamp = kBegin + Duration::FromSeconds(at),
                          .T_world_body = motion.At(at),
                          .v_world_body = motion.velocity,
                          .bias = {}};
    const std::vector<NavState> trajectory = GyroTrajectory(anchor, samples);
    ASSERT_EQ(trajectory.size(), samples.size());
    for (const NavState& state : trajectory) {
      const Pose3 truth = motion.At((state.stamp - kBegin).seconds());
      EXPECT_LT(BoxMinus(state.T_world_body, truth).norm(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace mlvi

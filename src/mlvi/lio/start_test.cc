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

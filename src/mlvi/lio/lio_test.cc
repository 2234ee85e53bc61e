// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/lio.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);
constexpr double kPeriod = 0.1;

struct Window {
  double from = 0.0, to = 0.0;
  bool Contains(double t) const { return t >= from && t < to; }
};

struct Scenario {
  test::SwingMotion motion;
  LioConfig config;
  double seconds = 4.0;
  double lidar_early = 0.0;  // s, by which the LiDAR's clock is behind the IMU's
  Window without_sweeps, without_imu;
};

struct Outcome {
  std::vector<OdometryEstimate> estimates;
  std::vector<LioResult> results;
};

Outcome Play(const Scenario& scenario) {
  const Rig rig = test::MakeTestRig();
  const test::BoxWorld world = test::FurnishedRoom();
  StageTimes times;
  Lio lio(scenario.config, rig, times);
  Outcome outcome;
  double seen = 0.0;
  for (int k = 0; (k + 1) * kPeriod <= scenario.seconds; ++k) {
    const double t = k * kPeriod;
    if (scenario.without_sweeps.Contains(t)) continue;
    LidarSweep sweep = test::Scan(world, scenario.motion, *rig.lidar, t + scenario.lidar_early,
                                  kBegin, RandomStream(5).Fork(k));
    sweep.stamp = sweep.stamp - Duration::FromSeconds(scenario.lidar_early);
    const double reached = t + kPeriod + std::max(scenario.lidar_early, 0.0);
    std::vector<ImuSample> imu =
        test::ImuRun(scenario.motion, rig, seen, reached, kBegin, RandomStream(6));
    std::erase_if(imu, [&](const ImuSample& sample) {
      return scenario.without_imu.Contains((sample.stamp - kBegin).seconds());
    });
    seen = reached;
    outcome.results.push_back(lio.Process(sweep, imu));
    const auto& estimates = outcome.results.back().estimates;
    outcome.estimates.insert(outcome.estimates.end(), estimates.begin(), estimates.end());
  }
  return outcome;
}

// Errors of position (m) and attitude (rad) of the last estimate, both seen from the first one.
Vector6d ErrorAtEnd(const Outcome& outcome, const test::SwingMotion& motion) {
  const auto truth = [&](const OdometryEstimate& e) {
    return motion.At((e.state.stamp - kBegin).seconds());
  };
  const OdometryEstimate& first = outcome.estimates.front();
  const OdometryEstimate& last = outcome.estimates.back();
  return BoxMinus(first.state.T_world_body.inverse() * last.state.T_world_body,
                  truth(first).inverse() * truth(last));
}

TEST(Lio, FollowsAMotionFromItsMovingStartInBothVariants) {
  for (const LioVariant variant : {LioVariant::kDensePlane, LioVariant::kEdgePlane}) {
    Scenario scenario{
        .motion = {.speed = 1.5}, .config = {}, .without_sweeps = {}, .without_imu = {}};
    scenario.config.variant = variant;
    const Outcome outcome = Play(scenario);
    ASSERT_EQ(outcome.estimates.size(), 40U);  // those kept back come out with the first
    const Vector6d error = ErrorAtEnd(outcome, scenario.motion);
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
    const NavState truth = scenario.motion.StateAt(4.0 - kPeriod / 600, kBegin);
    EXPECT_NEAR(outcome.estimates.back().state.v_world_body.norm(), truth.v_world_body.norm(),
                0.05);
  }
}

// The estimates are those of the LiDAR's instants, whatever its clock shows.
TEST(Lio, FindsTheTimeOffsetOfTheLidar) {
  for (const double offset : {-0.004, 0.0, 0.01}) {
    const Scenario scenario{.motion = {.speed = 1.5},
                            .config = {},
                            .seconds = 8.0,
                            .lidar_early = offset,
                            .without_sweeps = {},
                            .without_imu = {}};
    const Outcome outcome = Play(scenario);
    const TimeOffset found = outcome.results.back().time_offset;
    EXPECT_LT(found.sigma, 0.0003);
    EXPECT_LT(std::abs(found.seconds - offset), 3.0 * found.sigma) << found.seconds;
  }
}

// More than is a pause between two samples.
TEST(Lio, ExtendsItsMapWhateverTheOffset) {
  for (const double offset : {-0.028, 0.028}) {
    Scenario scenario{.motion = {.speed = 1.5},
                      .config = {},
                      .seconds = 6.0,
                      .lidar_early = offset,
                      .without_sweeps = {},
                      .without_imu = {}};
    const Outcome outcome = Play(scenario);
    ASSERT_EQ(outcome.estimates.size(), 60U);
    EXPECT_NEAR(outcome.results.back().time_offset.seconds, offset, 0.003);
    int extended = 0;
    for (const LioResult& result : outcome.results) extended += result.new_share > 0.0 ? 1 : 0;
    EXPECT_GT(extended, 40);
  }
}

TEST(Lio, HoldsTheTimeOffsetOfTheLidarWhenTold) {
  Scenario scenario{.motion = {.speed = 1.5},
                    .config = {},
                    .lidar_early = 0.004,
                    .without_sweeps = {},
                    .without_imu = {}};
  scenario.config.time_offset_sigma = 0.0;
  const LioResult last = Play(scenario).results.back();
  EXPECT_EQ(last.time_offset.seconds, 0.0);
  EXPECT_EQ(last.time_offset.sigma, 0.0);
}

TEST(Lio, KnowsNothingOfTheTimeOffsetAtRest) {
  const LioResult last =
      Play({.motion = {.speed = 0.0}, .config = {}, .without_sweeps = {}, .without_imu = {}})
          .results.back();
  EXPECT_LT(std::abs(last.time_offset.seconds), 0.3 * LioConfig().time_offset_sigma);
  EXPECT_GT(last.time_offset.sigma, 0.9 * LioConfig().time_offset_sigma);
}

TEST(Lio, TheSweepsOfAMovingStartAreDeskewedWithTheirOwnMotion) {
  const test::SteadyMotion motion{.velocity = {1.2, 0.5, 0.0}, .rate = {0.2, 0.0, 1.5}};
  Rig rig = test::MakeTestRig();
  rig.lidar->range_noise = 0.0;
  const test::BoxWorld world = test::FurnishedRoom();
  LioResult started;
  StageTimes times;
  Lio lio({}, rig, times);
  for (int k = 0; k < 15 && started.clouds.empty(); ++k) {
    const double t = k * kPeriod;
    started =
        lio.Process(test::Scan(world, motion, *rig.lidar, t, kBegin, RandomStream(5)),
                    test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(6), false));
  }
  ASSERT_GE(started.clouds.size(), 10U);
  // Turned by a sweep's 0.15 rad too far the velocity would leave 20 mm at the first firing.
  for (std::size_t i = 0; i < started.clouds.size(); ++i) {
    const double t = (started.estimates[i].state.stamp - kBegin).seconds();
    std::vector<double> off;
    for (const Eigen::Vector3f& p : *started.clouds[i]) {
      off.push_back(world.DistanceToFaces(motion.At(t) * p.cast<double>()));
    }
    ASSERT_GT(off.size(), 1000U);
    std::sort(off.begin(), off.end());
    EXPECT_LT(off[off.size() * 9 / 10], 0.001) << "sweep " << i;
  }
}

TEST(Lio, StartsAtRest) {
  const Outcome outcome = Play({.motion = {.speed = 0.0},
                                .config = {},
                                .seconds = 1.5,
                                .without_sweeps = {},
                                .without_imu = {}});
  ASSERT_EQ(outcome.estimates.size(), 15U);
  int kept_back = 0;
  for (const LioResult& result : outcome.results) {
    kept_back += result.status == LioResult::Status::kInitializing ? 1 : 0;
  }
  EXPECT_LE(kept_back, 6);
  for (const LioResult& result : outcome.results) {
    EXPECT_EQ(result.converged, result.status == LioResult::Status::kTracking);  // starts, too
  }
  EXPECT_LT(ErrorAtEnd(outcome, {.speed = 0.0}).norm(), 0.01);
}

// The estimates from `begin` on, as if they were all there is.
Outcome From(Time begin, const Outcome& whole) {
  Outcome part;
  for (const OdometryEstimate& estimate : whole.estimates) {
    if (estimate.state.stamp >= begin) part.estimates.push_back(estimate);
  }
  return part;
}

int Resets(const Outcome& outcome) {
  return static_cast<int>(std::count_if(outcome.results.begin(), outcome.results.end(),
                                        [](const LioResult& result) { return result.lost; }));
}

// The one result that brought the estimates of the new start.
const LioResult& Resumption(const Outcome& outcome) {
  const auto resumed = std::find_if(outcome.results.begin(), outcome.results.end(),
                                    [](const LioResult& result) { return result.gap.has_value(); });
  EXPECT_NE(resumed, outcome.results.end());
  return *resumed;
}

TEST(Lio, ContinuesAfterGaps) {
  Scenario scenario{.motion = {.speed = 1.0},
                    .config = {},
                    .seconds = 7.0,
                    .without_sweeps = {},
                    .without_imu = {}};
  scenario.without_sweeps = {3.0, 5.0};
  const Outcome lidar_gap = Play(scenario);
  ASSERT_EQ(lidar_gap.estimates.size(), 50U);
  EXPECT_EQ(Resets(lidar_gap), 0);
  EXPECT_LT(ErrorAtEnd(lidar_gap, scenario.motion).head<3>().norm(), 0.03);
  scenario.without_sweeps = {};
  scenario.without_imu = {3.0, 3.5};
  const Outcome imu_gap = Play(scenario);
  EXPECT_GE(imu_gap.estimates.size(), 60U);
  EXPECT_EQ(Resets(imu_gap), 0);
  EXPECT_LT(ErrorAtEnd(imu_gap, scenario.motion).head<3>().norm(), 0.03);
}

TEST(Lio, WhatNeverConvergesIsLost) {
  Scenario scenario{.motion = {.speed = 1.0},
                    .config = {},
                    .seconds = 4.0,
                    .without_sweeps = {},
                    .without_imu = {}};
  scenario.config.lost_after = 1.0;
  EXPECT_EQ(Resets(Play(scenario)), 0);
  scenario.config.registration.step_tolerance_m = 0.0;
  EXPECT_GE(Resets(Play(scenario)), 1);
}

TEST(Lio, StartsAnewInMotionAfterAMinuteWithoutAnything) {
  Scenario scenario{.motion = {.speed = 1.5},
                    .config = {},
                    .seconds = 67.0,
                    .without_sweeps = {3.0, 63.0},
                    .without_imu = {3.0, 63.0}};
  const Outcome outcome = Play(scenario);
  ASSERT_EQ(Resets(outcome), 1);
  ASSERT_EQ(outcome.estimates.size(), 70U);  // those of the new start come out with its first
  // The part after the pause is as good by itself as one from the first start (see above).
  const Outcome after = From(kBegin + Duration::FromSeconds(60.0), outcome);
  ASSERT_EQ(after.estimates.size(), 40U);
  const Vector6d error = ErrorAtEnd(after, scenario.motion);
  EXPECT_LT(error.head<3>().norm(), 0.02);
  EXPECT_LT(error.tail<3>().norm(), 0.01);
  // It begins where the body was last seen, with the heading of then, level, and says how little
  // that is worth.
  const OdometryEstimate& last = outcome.estimates[29];
  const OdometryEstimate& first = after.estimates.front();
  const Matrix6d gap = *Resumption(outcome).gap;
  EXPECT_LT((first.state.T_world_body.translation() - last.state.T_world_body.translation()).norm(),
            1e-6);
  EXPECT_NEAR(std::sqrt(gap(0, 0)), scenario.config.start.max_speed * 60.0, 1.0);
  const auto up_error = [&](const OdometryEstimate& e) {
    const double t = (e.state.stamp - kBegin).seconds();
    return (e.state.T_world_body.R().row(2) - scenario.motion.At(t).R().row(2)).norm();
  };
  EXPECT_LT(up_error(first), 0.01);
  EXPECT_GT((first.covariance.block<3, 3>(6, 6).trace()), 1.0);  // the heading
}

TEST(Lio, StartsAnewWithUnboundedUncertaintyOnlyWhereTheImuWasSilent) {
  // Twenty seconds without LiDAR are too long for this IMU, but it tells the heading.
  Scenario scenario{.motion = {.speed = 1.5},
                    .config = {},
                    .seconds = 27.0,
                    .without_sweeps = {3.0, 23.0},
                    .without_imu = {}};
  scenario.config.registration.max_search_distance = 1.0;
  const Outcome outcome = Play(scenario);
  ASSERT_EQ(Resets(outcome), 1);
  const Vector6d error =
      ErrorAtEnd(From(kBegin + Duration::FromSeconds(20.0), outcome), scenario.motion);
  EXPECT_LT(error.head<3>().norm(), 0.02);
  const Matrix6d gap = *Resumption(outcome).gap;
  const Vector6d whole = ErrorAtEnd(outcome, scenario.motion);
  EXPECT_LT(whole.head<3>().norm(), 3.0 * std::sqrt(gap.topLeftCorner<3, 3>().trace()));
  EXPECT_LT(whole.tail<3>().norm(), 0.05);
  EXPECT_LT(std::sqrt(gap.bottomRightCorner<3, 3>().trace()), 0.05);
}

TEST(Lio, AStartThatNeverComesAboutKeepsNothingAndDoesNotResetAgain) {
  const Rig rig = test::MakeTestRig();
  const test::BoxWorld world = test::FurnishedRoom();
  const test::SwingMotion motion{.speed = 1.5};
  StageTimes times;
  Lio lio({}, rig, times);
  std::vector<LioResult> results;
  const auto play = [&](double from, double to, bool contradictory) {
    for (int k = static_cast<int>(std::lround(from / kPeriod)); (k + 1) * kPeriod <= to; ++k) {
      const double t = k * kPeriod;
      std::vector<ImuSample> imu =
          test::ImuRun(motion, rig, t, t + kPeriod, kBegin, RandomStream(6));
      for (ImuSample& sample : imu) {
        if (contradictory) sample.linear_acceleration *= 2.0;
      }
      results.push_back(lio.Process(
          test::Scan(world, motion, *rig.lidar, t, kBegin, RandomStream(5).Fork(k), {16, 300}),
          imu));
    }
  };
  play(0.0, 2.0, false);
  ASSERT_EQ(results.back().status, LioResult::Status::kTracking);
  play(40.0, 47.0, true);
  EXPECT_EQ(std::count_if(results.begin(), results.end(), [](const auto& r) { return r.lost; }), 1);
  EXPECT_EQ(results.back().status, LioResult::Status::kInitializing);
  EXPECT_FALSE(results.back().reason.empty());
  EXPECT_LE(lio.imu_samples(), 60U * 200U + 2U);
  play(100.0, 103.0, false);
  EXPECT_EQ(results.back().status, LioResult::Status::kTracking);
}

TEST(Lio, TheSameBitsAtAnyNumberOfThreads) {
  std::vector<Outcome> outcomes;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    outcomes.push_back(Play({.motion = {.speed = 1.5},
                             .config = {},
                             .seconds = 2.0,
                             .without_sweeps = {},
                             .without_imu = {}}));
  }
  ASSERT_EQ(outcomes[0].estimates.size(), outcomes[1].estimates.size());
  ASSERT_GT(outcomes[0].estimates.size(), 10U);
  for (std::size_t i = 0; i < outcomes[0].estimates.size(); ++i) {
    const NavState &a = outcomes[0].estimates[i].state, &b = outcomes[1].estimates[i].state;
    EXPECT_EQ(BoxMinus(a, b).norm(), 0.0);
    EXPECT_EQ(outcomes[0].estimates[i].covariance, outcomes[1].estimates[i].covariance);
  }
}

class LioRejectionTest : public ::testing::Test {
 protected:
  LioResult Give(double t, const LidarSweep& sweep) {
    return lio_.Process(sweep, test::ImuRun(motion_, rig_, std::max(0.0, t - kPeriod), t + kPeriod,
                                            kBegin, RandomStream(1)));
  }
  LidarSweep At(double t) {
    return test::Scan(world_, motion_, *rig_.lidar, t, kBegin, RandomStream(2));
  }

  Rig rig_ = test::MakeTestRig();
  test::BoxWorld world_ = test::FurnishedRoom();
  test::SwingMotion motion_{.speed = 0.0};
  StageTimes times_;
  Lio lio_{LioConfig(), rig_, times_};
};

TEST_F(LioRejectionTest, RefusesWhatItCannotUseAndSaysWhy) {
  LidarSweep empty;
  empty.stamp = kBegin;
  EXPECT_EQ(Give(0.0, empty).rejection, "empty sweep");
  LidarSweep tiny = At(0.0);
  tiny.points.resize(20);
  const LioResult result = Give(0.0, tiny);
  EXPECT_EQ(result.status, LioResult::Status::kRejected);
  EXPECT_EQ(result.rejection, "too few points");
  EXPECT_NE(result.reason.find("20 points"), std::string::npos);
  for (int k = 0; k < 10; ++k) Give(k * kPeriod, At(k * kPeriod));
  EXPECT_EQ(Give(1.0, At(1.0)).status, LioResult::Status::kTracking);
  EXPECT_EQ(Give(0.5, At(0.5)).rejection, "out of order");
  EXPECT_EQ(lio_.Process(At(2.3), {}).rejection, "IMU missing");
}

TEST_F(LioRejectionTest, SamplesAreForgottenWhileNoSweepIsOfUse) {
  LidarSweep empty;
  empty.span = Duration::FromSeconds(kPeriod);
  std::size_t most = 0;
  for (int k = 0; k < 3000; ++k) {
    empty.stamp = kBegin + Duration::FromSeconds(k * kPeriod);
    EXPECT_EQ(Give(k * kPeriod, empty).rejection, "empty sweep");
    most = std::max(most, lio_.imu_samples());
  }
  EXPECT_LE(most, 60U * 200U + 2U);
  LioResult result;
  for (int k = 3000; k < 3015; ++k) result = Give(k * kPeriod, At(k * kPeriod));
  EXPECT_EQ(result.status, LioResult::Status::kTracking);
}

TEST(Lio, TheMapAgesByWhatIsNewToIt) {
  const Outcome outcome =
      Play({.motion = {.speed = 1.5}, .config = {}, .without_sweeps = {}, .without_imu = {}});
  double age = 0.0;
  std::optional<double> new_share;  // of the sweep before
  for (const LioResult& result : outcome.results) {
    if (result.estimates.empty()) continue;
    const std::optional<MapTie>& tie = result.estimates.back().map;
    ASSERT_TRUE(tie.has_value());
    EXPECT_GE(tie->age, age);
    if (new_share) {
      EXPECT_NEAR(tie->age - age, -std::log1p(-*new_share), 1e-12);
    }
    age = tie->age;
    if (result.estimates.size() == 1) new_share = result.new_share;  // a start tells not all of its
  }
  EXPECT_GT(age, 1.0);
}

TEST(Lio, OfAStartTheLastStateIsTiedToTheMapAndTheOthersToIt) {
  const Outcome outcome =
      Play({.motion = {.speed = 1.5}, .config = {}, .without_sweeps = {}, .without_imu = {}});
  int starts = 0;
  for (const LioResult& result : outcome.results) {
    if (result.estimates.empty()) continue;
    if (result.estimates.size() > 1) ++starts;
    ASSERT_EQ(result.relative.size() + 1, result.estimates.size());
    for (std::size_t i = 0; i < result.relative.size(); ++i) {
      EXPECT_FALSE(result.estimates[i].map.has_value());
      EXPECT_GT(result.relative[i].diagonal().minCoeff(), 0.0);
    }
    EXPECT_TRUE(result.estimates.back().map.has_value());
  }
  EXPECT_EQ(starts, 1);
}

TEST(LioContract, NeedsALidar) {
  Rig rig = test::MakeTestRig();
  rig.lidar.reset();
  StageTimes times;
  EXPECT_THROW(Lio(LioConfig(), rig, times), ContractViolation);
}

}  // namespace
}  // namespace mlvi

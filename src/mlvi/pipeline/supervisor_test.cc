// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mlvi {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SupervisorTest : public ::testing::Test {
 protected:
  SupervisorTest() {
    events_.Subscribe([this](const Event& event) { messages_.push_back(event.message); });
  }
  static Rig TestRig() {
    Rig rig;
    rig.imu.rate_hz = 100.0;
    rig.imu.accelerometer_saturation = 50.0;
    rig.lidar.emplace();
    return rig;
  }
  static LidarSweep SweepAt(double t) {
    return {.stamp = Time::FromSeconds(t), .points = {}, .span = Duration::FromSeconds(0.1)};
  }
  static LioResult Tracking(bool converged) {
    LioResult result;
    result.status = LioResult::Status::kTracking;
    result.converged = converged;
    result.estimates.resize(1);
    return result;
  }

  EventBus events_;
  std::vector<std::string> messages_;
  Supervisor supervisor_{SupervisorConfig{}, TestRig(), events_};
};

TEST_F(SupervisorTest, ReportsImuGapsOnceAndCountsThemAll) {
  for (const double t : {1.0, 1.01, 1.51, 1.52, 1.92})
    supervisor_.Observe(ImuSample{.stamp = Time::FromSeconds(t)});
  supervisor_.Conclude();
  const StreamReport& imu = supervisor_.streams().at("imu");
  EXPECT_EQ(imu.gaps, 2);
  EXPECT_NEAR(imu.longest_gap, 0.5, 1e-9);
  EXPECT_EQ(imu.health.level, HealthLevel::kDegraded);
  EXPECT_THAT(messages_, ElementsAre(AllOf(HasSubstr("gap of 0.500 s"), HasSubstr("nominal 0.01 s"),
                                           HasSubstr("from 0.05 s on"))));
}

TEST_F(SupervisorTest, SaturationDegradesTheImu) {
  supervisor_.Observe(
      ImuSample{.stamp = Time::FromSeconds(0.0), .linear_acceleration = {50.0, 0.0, 0.0}});
  supervisor_.Conclude();
  EXPECT_THAT(supervisor_.streams().at("imu").health.reason, HasSubstr("saturation"));
}

TEST_F(SupervisorTest, AStreamWithoutMeasurementsHasFailed) {
  supervisor_.Conclude();
  EXPECT_EQ(supervisor_.streams().at("lidar").health.level, HealthLevel::kFailed);
}

TEST_F(SupervisorTest, LostOnlyAfterManyFailuresInARow) {
  double t = 0.0;
  const auto observe = [&](bool converged) {
    supervisor_.Observe(SweepAt(t += 0.1), Tracking(converged));
  };
  observe(true);
  for (int i = 0; i < 9; ++i) observe(false);
  observe(true);
  for (int i = 0; i < 9; ++i) observe(false);
  EXPECT_FALSE(supervisor_.odometry().lost);
  observe(false);
  EXPECT_TRUE(supervisor_.odometry().lost);
  EXPECT_EQ(supervisor_.odometry().sweeps_unconverged, 19);
}

class ResetTest : public SupervisorTest {
 protected:
  ResetTest() {
    supervisor_.Observe(SweepAt(0.0), Tracking(true));
    LioResult lost;
    lost.lost = true;
    lost.reason = "no registration for 61 s";
    supervisor_.Observe(SweepAt(61.0), lost);
    for (int k = 1; k <= 20; ++k) supervisor_.Observe(SweepAt(61.0 + 0.1 * k), LioResult());
  }
};

TEST_F(ResetTest, ALossIsReportedWithInstantReasonAndRemedy) {
  const OdometryReport& report = supervisor_.odometry();
  EXPECT_TRUE(report.lost);
  ASSERT_EQ(report.resets.size(), 1U);
  EXPECT_EQ(report.resets[0].lost, Time::FromSeconds(61.0));
  EXPECT_FALSE(report.resets[0].resumed.valid());
  EXPECT_EQ(report.resets[0].sweeps_without_pose, 21);
  EXPECT_THAT(report.lost_reason, HasSubstr("no registration for 61 s"));
  EXPECT_THAT(messages_.back(), HasSubstr("lio.lost_after"));
}

TEST_F(ResetTest, ANewStartEndsIt) {
  LioResult resumed = Tracking(false);
  resumed.gap = Matrix6d::Identity();
  resumed.estimates.resize(12);
  resumed.estimates.front().state.stamp = Time::FromSeconds(62.0);
  supervisor_.Observe(SweepAt(63.1), resumed);
  for (int k = 1; k <= 20; ++k) supervisor_.Observe(SweepAt(63.1 + 0.1 * k), Tracking(true));
  const OdometryReport& report = supervisor_.odometry();
  EXPECT_FALSE(report.lost);
  ASSERT_EQ(report.resets.size(), 1U);
  EXPECT_EQ(report.resets[0].resumed, Time::FromSeconds(62.0));
  EXPECT_EQ(report.resets[0].sweeps_without_pose, 10);  // 22 sweeps from the loss on, 12 came back
  EXPECT_THAT(messages_.back(), HasSubstr("found again"));
}

TEST_F(SupervisorTest, CountsRejectedSweepsByReason) {
  LioResult rejected;
  rejected.status = LioResult::Status::kRejected;
  rejected.rejection = "empty";
  supervisor_.Observe(SweepAt(0.0), rejected);
  supervisor_.Observe(SweepAt(0.1), rejected);
  supervisor_.AddDropped({{"lidar", {{"duplicate stamp", 3}}}});
  supervisor_.Conclude();
  const StreamReport& lidar = supervisor_.streams().at("lidar");
  EXPECT_EQ(lidar.received, 5);
  EXPECT_EQ(lidar.dropped.at("empty"), 2);
  EXPECT_EQ(lidar.dropped.at("duplicate stamp"), 3);
  EXPECT_EQ(messages_.size(), 1U);
  EXPECT_EQ(lidar.health.level, HealthLevel::kFailed);
  EXPECT_THAT(lidar.health.reason,
              HasSubstr("5 of 5 sweeps dropped ('duplicate stamp' 3, 'empty' 2)"));
}

// The reader found them unusable: to the user it is one stream, whoever dropped its measurements.
TEST_F(SupervisorTest, GapsNameWhatWasDroppedAsTheirCause) {
  for (int k = 0; k < 60; ++k) {
    if (k < 30 || k >= 36) supervisor_.Observe(SweepAt(1.0 + 0.1 * k), Tracking(true));
  }
  supervisor_.AddDropped({{"lidar", {{"no valid point", 6}}}});
  supervisor_.Conclude();
  const StreamReport& lidar = supervisor_.streams().at("lidar");
  EXPECT_EQ(lidar.received, 60);
  EXPECT_EQ(lidar.health.level, HealthLevel::kDegraded);
  EXPECT_THAT(lidar.health.reason,
              AllOf(HasSubstr("6 of 60 sweeps dropped ('no valid point' 6)"), HasSubstr("1 gaps")));
  EXPECT_NEAR(*lidar.rate_hz, 10.0, 0.01);
}

TEST_F(SupervisorTest, AFewDroppedMeasurementsWithoutGapsDoNoHarm) {
  for (int k = 0; k < 60; ++k) supervisor_.Observe(SweepAt(1.0 + 0.1 * k), Tracking(true));
  supervisor_.AddDropped({{"lidar", {{"duplicate stamp", 3}}}});
  supervisor_.Conclude();
  EXPECT_EQ(supervisor_.streams().at("lidar").health.level, HealthLevel::kHealthy);
}

TEST_F(SupervisorTest, RatesThatContradictTheRigAreAnnouncedEarlyAndDegradeTheirStream) {
  for (int k = 0; k < 100; ++k) supervisor_.Observe(SweepAt(1.0 + 0.05 * k), Tracking(true));
  EXPECT_THAT(messages_,
              ElementsAre(AllOf(HasSubstr("20.0 Hz"), HasSubstr("lidar.rate_hz is 10"))));
  supervisor_.Conclude();
  EXPECT_EQ(supervisor_.streams().at("lidar").health.level, HealthLevel::kDegraded);
  EXPECT_THAT(supervisor_.streams().at("lidar").health.reason, HasSubstr("lidar.rate_hz"));
}

TEST_F(SupervisorTest, AnImuWithoutGravityIsAnnouncedEarlyAndHasFailed) {
  for (int k = 0; k < 300; ++k) {
    const double value = 0.01 * k;
    supervisor_.Observe(ImuSample{.stamp = Time::FromSeconds(1.0 + 0.01 * k),
                                  .angular_velocity = {value, 0.0, 0.0}});
  }
  EXPECT_THAT(messages_, ::testing::Contains(HasSubstr("specific force")));
  supervisor_.Conclude();
  EXPECT_EQ(supervisor_.streams().at("imu").health.level, HealthLevel::kFailed);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/sequencer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mlvi {
namespace {

ImuSample Imu(double t) { return {.stamp = Time::FromSeconds(t)}; }
LidarSweep Sweep(double begin, double span) {
  return {.stamp = Time::FromSeconds(begin), .points = {}, .span = Duration::FromSeconds(span)};
}

class SequencerTest : public ::testing::Test {
 protected:
  SequencerTest() {
    events_.Subscribe([this](const Event& event) { messages_.push_back(event.message); });
  }
  // Pushes and appends to `out_` what comes out, as "I1.00" or "S0.10".
  void Push(Measurement measurement) { Append(sequencer_.Push(std::move(measurement))); }
  void Append(const std::vector<Measurement>& measurements) {
    for (const Measurement& m : measurements) {
      const char kind = std::holds_alternative<ImuSample>(m) ? 'I' : 'S';
      out_.push_back(fmt::format("{}{:.2f}", kind,
                                 std::visit([](const auto& x) { return x.stamp.seconds(); }, m)));
    }
  }

  EventBus events_;
  std::vector<std::string> messages_;
  Sequencer sequencer_{SequencerConfig{}, events_};
  std::vector<std::string> out_;
};

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(SequencerTest, HoldsASweepUntilTheImuReachesItsLastFiring) {
  Push(Imu(0.00));
  Push(Sweep(0.00, 0.10));
  Push(Imu(0.05));
  EXPECT_THAT(out_, ElementsAre("I0.00", "I0.05"));
  Push(Imu(0.12));
  EXPECT_THAT(out_, ElementsAre("I0.00", "I0.05", "I0.12", "S0.00"));
}

TEST_F(SequencerTest, EmitsSweepsInTheOrderOfTheirLastFiring) {
  Push(Sweep(0.20, 0.10));
  // An older stamp of the same stream cannot be told from a clock that jumped back.
  Push(Sweep(0.10, 0.10));
  Push(Imu(0.50));
  EXPECT_THAT(out_, ElementsAre("I0.50", "S0.20"));
  EXPECT_EQ(sequencer_.dropped().at("lidar").at("stamp goes back in time"), 1);
}

TEST_F(SequencerTest, DropsDuplicatesAndReportsAJumpBackOnce) {
  Push(Imu(1.00));
  Push(Imu(1.00));
  Push(Imu(0.50));
  Push(Imu(0.60));
  Push(Imu(1.10));
  EXPECT_THAT(out_, ElementsAre("I1.00", "I1.10"));
  EXPECT_EQ(sequencer_.dropped().at("imu").at("duplicate stamp"), 1);
  EXPECT_EQ(sequencer_.dropped().at("imu").at("stamp goes back in time"), 2);
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("jumps back by 0.500 s")));
}

TEST_F(SequencerTest, AJumpAheadNeedsConfirmation) {
  Push(Imu(1.0));
  Push(Imu(1e6));
  Push(Imu(1.1));
  EXPECT_THAT(out_, ElementsAre("I1.00", "I1.10"));
  Push(Imu(1000.0));
  Push(Imu(1000.1));
  EXPECT_THAT(out_, ElementsAre("I1.00", "I1.10", "I1000.10"));
}

TEST_F(SequencerTest, GivesUpOnSweepsThatNoImuReachesAndStaysBounded) {
  Push(Imu(0.0));
  for (int i = 0; i < 100; ++i) Push(Sweep(0.1 * i, 0.1));
  EXPECT_EQ(sequencer_.dropped().at("lidar").at("not covered by IMU"), 89);
  EXPECT_EQ(messages_.size(), 1U);
  Append(sequencer_.Flush());
  EXPECT_THAT(out_, ElementsAre("I0.00"));
  EXPECT_EQ(sequencer_.dropped().at("lidar").at("not covered by IMU at the end of the recording"),
            11);
}

}  // namespace
}  // namespace mlvi

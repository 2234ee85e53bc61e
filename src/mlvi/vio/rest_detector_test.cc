// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/rest_detector.h"

#include <gtest/gtest.h>

#include "mlvi/imu/propagation.h"
#include "mlvi/vio/testing.h"

namespace mlvi {
namespace {

test::SyntheticOptions Standing() {
  test::SyntheticOptions options;
  options.seconds = 3.0;
  options.pixel_noise = 0.1;
  options.walk.yaw_rate = 0.0;
  options.walk.sway_amplitude.setZero();
  options.walk.velocity.setZero();
  options.walk.position_amplitude.setZero();
  return options;
}

// Of the last half second of a recording.
bool SeemsAtRest(const test::SyntheticRecording& recording, const RestConfig& config) {
  const FrameId earlier(recording.frame().value() - 10);
  const Time from = recording.stamp() - Duration::FromSeconds(0.5);
  return IsAtRest(recording.tracks(), earlier, recording.frame(),
                  SamplesBetween(recording.samples(), from, recording.stamp()), recording.rig().imu,
                  config);
}

// The share of sets in which the rig seems to stand.
double ShareAtRest(const test::SyntheticOptions& options) {
  test::SyntheticRecording recording(options);
  int rests = 0;
  for (int set = 0; set < recording.sets(); ++set) {
    recording.Advance();
    if (set >= 10 && SeemsAtRest(recording, {})) ++rests;
  }
  return static_cast<double>(rests) / (recording.sets() - 10);
}

TEST(RestDetectorTest, TellsStandingFromMoving) {
  EXPECT_EQ(ShareAtRest(Standing()), 1.0);
  test::SyntheticOptions walking;
  walking.seconds = 3.0;
  EXPECT_EQ(ShareAtRest(walking), 0.0);
  test::SyntheticOptions rolling = Standing();  // evenly, as the IMU does not feel
  rolling.walk.velocity = {0.1, 0.0, 0.0};
  EXPECT_EQ(ShareAtRest(rolling), 0.0);
  test::SyntheticOptions turning = Standing();
  turning.walk.yaw_rate = 0.02;
  EXPECT_EQ(ShareAtRest(turning), 0.0);
}

TEST(RestDetectorTest, FewTracksOrSamplesTellNothing) {
  test::SyntheticOptions options = Standing();
  options.budget = 10;
  EXPECT_EQ(ShareAtRest(options), 0.0);
  test::SyntheticRecording recording(Standing());
  for (int set = 0; set < 20; ++set) recording.Advance();
  EXPECT_TRUE(SeemsAtRest(recording, {}));
  EXPECT_FALSE(SeemsAtRest(recording, {.enabled = false}));
  EXPECT_FALSE(
      IsAtRest(recording.tracks(), FrameId(9), recording.frame(), {}, recording.rig().imu, {}));
}

// Metres by which the window is off after three seconds at rest, root mean square over seeds.
double ErrorAtRest(const RestConfig& config) {
  double sum = 0.0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    test::SyntheticOptions options = Standing();
    options.seed = seed;
    WindowConfig window_config;
    window_config.pixel_sigma = options.pixel_noise;
    window_config.pixel_drift = 0.0;
    const auto look = [&](test::SyntheticRecording& recording, SlidingWindow& window) {
      if (recording.frame().value() >= 10 && SeemsAtRest(recording, config)) {
        window.AddRest(config.velocity_sigma);
      }
    };
    const test::SyntheticRun run = test::RunWindow(options, window_config, {}, look);
    sum += run.LastError().segment<3>(nav_index::kPosition).squaredNorm();
  }
  return std::sqrt(sum / 3.0);
}

// The first half second, before rest shows, is left to an IMU with 5 cm/s of error: 2.5 cm.
TEST(RestDetectorTest, KeepsTheWindowWhereItIs) {
  EXPECT_LT(ErrorAtRest({}), 0.05);
  EXPECT_GT(ErrorAtRest({.enabled = false}), 0.1);
}

}  // namespace
}  // namespace mlvi

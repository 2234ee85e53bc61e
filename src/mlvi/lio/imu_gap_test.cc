// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/imu_gap.h"

#include <gtest/gtest.h>

#include "mlvi/imu/preintegration.h"

namespace mlvi {
namespace {

Time At(double seconds) { return Time::FromSeconds(1000.0 + seconds); }

std::vector<ImuSample> Samples(const std::vector<double>& seconds) {
  std::vector<ImuSample> samples(seconds.size());
  for (std::size_t i = 0; i < seconds.size(); ++i) samples[i].stamp = At(seconds[i]);
  return samples;
}

TEST(SilentTime, CountsOnlyPausesInsideTheInterval) {
  const std::vector<ImuSample> regular = Samples({0.00, 0.01, 0.02, 0.03, 0.04, 0.05});
  EXPECT_EQ(SilentTime(regular, At(0.005), At(0.05), 100.0), 0.0);
  const std::vector<ImuSample> paused = Samples({0.00, 0.01, 0.21, 0.22});
  EXPECT_NEAR(SilentTime(paused, At(0.0), At(0.22), 100.0), 0.20, 1e-9);
  EXPECT_NEAR(SilentTime(paused, At(0.1), At(0.15), 100.0), 0.05, 1e-9);  // wholly inside the pause
  EXPECT_NEAR(SilentTime(paused, At(0.1), At(0.22), 100.0), 0.11, 1e-9);
  EXPECT_NEAR(SilentTime(paused, At(0.21), At(0.40), 100.0), 0.18, 1e-9);  // ends early
  EXPECT_NEAR(SilentTime({}, At(0.0), At(0.1), 100.0), 0.1, 1e-9);
}

// Five periods of a slow IMU are as long as a sweep.
TEST(SilentTime, SeesAPauseThatInterpolatedSamplesCut) {
  const std::vector<ImuSample> paused = Samples({0.00, 0.02, 0.42, 0.44});
  std::vector<ImuSample> fed;  // as they come with sweeps of 0.1 s
  for (int k = 0; k < 4; ++k) {
    for (const ImuSample& sample : SamplesBetween(paused, At(0.1 * k), At(0.1 * (k + 1)))) {
      if (fed.empty() || sample.stamp > fed.back().stamp) fed.push_back(sample);
    }
  }
  EXPECT_NEAR(SilentTime(fed, At(0.0), At(0.1), 50.0), 0.08, 1e-9);
  EXPECT_NEAR(SilentTime(fed, At(0.1), At(0.2), 50.0), 0.1, 1e-9);
  EXPECT_NEAR(SilentTime(fed, At(0.0), At(0.4), 50.0), 0.38, 1e-9);
}

TEST(Bent, KeepsTheStartAndMeetsTheEnd) {
  std::vector<NavState> states(11);
  for (int i = 0; i <= 10; ++i) {
    states[i].stamp = At(0.01 * i);
    states[i].T_world_body = Pose3::FromTranslation({0.01 * i, 0.0, 0.0});
  }
  const Pose3 end(ExpSo3(Eigen::Vector3d(0.0, 0.0, 0.2)), Eigen::Vector3d(0.1, 0.04, 0.0));
  const std::vector<NavState> bent = Bent(states, end);
  EXPECT_LT(BoxMinus(bent.front().T_world_body, states.front().T_world_body).norm(), 1e-12);
  EXPECT_LT(BoxMinus(bent.back().T_world_body, end).norm(), 1e-12);
  EXPECT_NEAR(LogSo3(bent[5].T_world_body.rotation()).z(), 0.1, 1e-9);
}

}  // namespace
}  // namespace mlvi

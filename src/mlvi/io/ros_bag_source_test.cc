// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_bag_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "mlvi/io/rig_file.h"
#include "mlvi/io/tum.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

std::string SharedData(const std::string& path) { return std::string(MLVI_SHARED_DATA_DIR) + "/" + path; }

#define MLVI_SKIP_WITHOUT(path)                                                     \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not on this machine"

TEST(RosBagSource, ReadsTheWalk) {
  const std::string bag = SharedData("walk_os0/walk_os0.bag");
  MLVI_SKIP_WITHOUT(bag);
  const auto rig = LoadRig("walk_os0");
  ASSERT_TRUE(rig) << rig.error().message;
  auto source = RosBagSource::Open({bag}, *rig);
  ASSERT_TRUE(source) << source.error().message;
  int sweeps = 0, samples = 0;
  double norm = 0.0;
  Time last_sweep;
  std::size_t fewest = 1u << 30;
  while (true) {
    const auto next = (*source)->Next();
    ASSERT_TRUE(next) << next.error().message;
    if (!*next) break;
    if (const auto* sweep = std::get_if<LidarSweep>(&**next)) {
      ++sweeps;
      EXPECT_LT(last_sweep, sweep->stamp);
      EXPECT_EQ(sweep->span, Duration());
      EXPECT_FALSE(sweep->has_times);
      last_sweep = sweep->stamp;
      fewest = std::min(fewest, sweep->points.size());
    } else if (const auto* sample = std::get_if<ImuSample>(&**next)) {
      ++samples;
      norm += sample->linear_acceleration.norm();
    }
  }
  EXPECT_EQ(sweeps, 76);
  EXPECT_GT(fewest, 10000u);
  EXPECT_EQ(samples, 7705);
  EXPECT_NEAR(norm / samples, 9.8, 0.5);
  EXPECT_DOUBLE_EQ((*source)->Progress(), 1.0);
  std::printf("mean norm %.4f fewest %zu\n", norm / samples, fewest);
  for (const auto& n : (*source)->Notes()) std::printf("note %s\n", n.c_str());
  for (const auto& [t, c] : (*source)->Counts()) {
    std::printf("%s messages %ld delivered %ld\n", t.c_str(), c.messages, c.delivered);
    for (const auto& [r, n] : c.repaired) std::printf("   %s: %ld\n", r.c_str(), n);
  }
}

}  // namespace
}  // namespace mlvi

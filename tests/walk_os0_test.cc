// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A real recording that starts in motion: 76 sweeps at 2 Hz, x, y and z only, against its published
// poses.
#include <gtest/gtest.h>

#include <filesystem>

#include "mlvi/eval/evaluation.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/io/tum.h"
#include "mlvi/pipeline/slam.h"

namespace mlvi {
namespace {

double Ate(const Trajectory& estimate, const Trajectory& truth) {
  const auto evaluation = Evaluate(estimate, truth, {});
  EXPECT_TRUE(evaluation.has_value()) << evaluation.error().message;
  return evaluation ? evaluation->absolute_translation.rmse : 1e9;
}

TEST(WalkOs0, StartsInMotionUsesEverySweepAndStaysWithinTheErrorOfThePublishedPoses) {
  const std::string folder = std::string(MLVI_SHARED_DATA_DIR) + "/walk_os0";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not on this machine";
  Expected<Rig> rig = LoadRig("walk_os0");
  ASSERT_TRUE(rig.has_value()) << rig.error().message;
  rig->cameras.clear();
  auto source = RosBagSource::Open({folder + "/walk_os0.bag"}, *rig);
  ASSERT_TRUE(source.has_value()) << source.error().message;
  Slam slam(SlamConfig{}, *rig);
  while (true) {
    const auto next = (*source)->Next();
    ASSERT_TRUE(next.has_value()) << next.error().message;
    if (!*next) break;
    slam.Process(**next);
  }
  slam.Finish();
  EXPECT_EQ(slam.odometry().size(), 76U);
  EXPECT_EQ(slam.supervisor().streams().at("lidar").used, 76);
  EXPECT_TRUE(slam.supervisor().odometry().resets.empty());
  EXPECT_FALSE(slam.supervisor().odometry().lost);
  const auto truth = ReadTum(folder + "/groundtruth.tum");
  ASSERT_TRUE(truth.has_value()) << truth.error().message;
  EXPECT_LT(Ate(slam.odometry(), *truth), 0.045);
  EXPECT_LT(Ate(slam.SmoothedTrajectory(), *truth), 0.045);
}

}  // namespace
}  // namespace mlvi

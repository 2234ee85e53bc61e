// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_simulator.h"

#include <gtest/gtest.h>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

class Lidars : public ::testing::TestWithParam<std::tuple<int, std::string>> {
 protected:
  static Rig MakeRig(int which) {
    return which == 0 ? test::NewerCollege() : which == 1 ? test::M2dgr() : test::Hilti();
  }
};

// The law of the simulator: undo the motion with the true trajectory, and every return lies on the
// mesh along its own beam, within the range noise; the noise has the specified size.
TEST_P(Lidars, ReturnsLieOnTheMeshAfterExactDeskewing) {
  const auto& [which, sequence] = GetParam();
  SequenceOptions options = StandardSequence(sequence, MakeRig(which), 1.0, 3);
  options.rest = 0.0;
  const Recording recording(options);
  LidarPattern pattern = recording.lidar().pattern();
  pattern.physics.beam_noise = 0.0;  // so that the nominal beam is the true one
  const Pose3 T_body_lidar = options.rig.true_rig.lidar->T_body_lidar;
  const LidarSimulator lidar(pattern, T_body_lidar, RandomStream(5));
  const Time stamp = recording.begin() + Duration::FromMilliseconds(500);
  const LidarSweep sweep = lidar.Sweep(recording.world(), recording.motion(), stamp, 0);
  double sum = 0.0, squares = 0.0;
  std::size_t returns = 0, ring_errors = 0;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const LidarPoint& p = sweep.points[i];
    ring_errors += p.ring != pattern.rays[i].ring;
    if (p.position.isZero(0.0F)) continue;
    const Pose3 T_world_lidar =
        recording.motion().PoseAt(stamp + Duration::FromNanoseconds(p.offset_ns)) * T_body_lidar;
    const Eigen::Vector3d origin = T_world_lidar * pattern.rays[i].origin.cast<double>();
    const Eigen::Vector3d ray = T_world_lidar * p.position.cast<double>() - origin;
    const auto hit = recording.world().Cast(origin, ray.normalized(), 300.0);
    ASSERT_TRUE(hit.has_value()) << i;
    const double error = ray.norm() - hit->range;
    // Rays along an edge may see the other side of it after rounding to float: a handful, not
    // asserted one by one.
    if (std::abs(error) > 6.0 * pattern.physics.range_noise + 0.01) continue;
    sum += error, squares += error * error, ++returns;
  }
  const auto all = static_cast<std::size_t>(
      std::count_if(sweep.points.begin(), sweep.points.end(),
                    [](const LidarPoint& p) { return !p.position.isZero(0.0F); }));
  ASSERT_GT(all, pattern.rays.size() / 3);
  EXPECT_EQ(ring_errors, 0U);
  EXPECT_GE(returns + all / 2000, all);
  const double n = static_cast<double>(returns), sigma = pattern.physics.range_noise;
  EXPECT_NEAR(sum / n, 0.0, 5.0 * sigma / std::sqrt(n) + 1e-5);
  EXPECT_NEAR(std::sqrt(squares / n), sigma, 0.02 * sigma);
  RecordProperty("share_of_returns", std::to_string(static_cast<double>(all) /
                                                    static_cast<double>(pattern.rays.size())));
}

// Most beams find something; what is missing is sky, far grazing ground, glass, and random
// dropouts.
TEST_P(Lidars, WorldsAreClosedEnough) {
  const auto& [which, sequence] = GetParam();
  const Recording recording(StandardSequence(sequence, MakeRig(which), 1.0));
  const LidarSweep sweep =
      recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 0);
  const auto returns = std::count_if(sweep.points.begin(), sweep.points.end(),
                                     [](const LidarPoint& p) { return !p.position.isZero(0.0F); });
  const double share = static_cast<double>(returns) / static_cast<double>(sweep.points.size());
  RecordProperty("share_of_returns", std::to_string(share));
  EXPECT_GT(share, 0.8) << sequence;
}

INSTANTIATE_TEST_SUITE_P(Models, Lidars,
                         ::testing::Combine(::testing::Values(0, 1, 2),
                                            ::testing::Values("courtyard-hard", "corridor-easy")));

TEST(LidarPattern, MatchesTheSensors) {
  const LidarPattern os0 = MakeLidarPattern("OS0-128").value();
  EXPECT_EQ(os0.rays.size(), 128U * 1024U);
  EXPECT_EQ(os0.rays[1024].ring, 1);  // organised ring by ring
  EXPECT_EQ(os0.firing_offsets_ns[1], 97656);
  EXPECT_NEAR(os0.rays[0].direction.z(), std::sin(45.75 * M_PI / 180.0), 1e-6);
  // Before the first column's 11.24 deg offset the head looks backwards, and it turns clockwise.
  EXPECT_LT(os0.rays[0].origin.x(), -0.02F);
  EXPECT_GT(os0.rays[256].origin.y(), 0.02F);
  const LidarPattern vlp = MakeLidarPattern("VLP-32C").value();
  EXPECT_EQ(vlp.rays.size(), 32U * 1808U);
  EXPECT_EQ(vlp.firing_offsets_ns.size(), 16U * 1808U);
  EXPECT_EQ(vlp.rays[1].ring, 17);  // laser 1
  EXPECT_EQ(vlp.rays[0].firing, vlp.rays[1].firing);
  const LidarPattern xt = MakeLidarPattern("PandarXT-32").value();
  EXPECT_EQ(xt.rays.size(), 32U * 2000U);
  for (const LidarPattern* p : {&os0, &vlp, &xt}) {
    EXPECT_TRUE(std::is_sorted(p->firing_offsets_ns.begin(), p->firing_offsets_ns.end()));
    EXPECT_EQ(p->firing_offsets_ns.front(), 0);
    EXPECT_LT(p->span().seconds(), 0.1);
    EXPECT_GT(p->span().seconds(), 0.0995);
  }
  EXPECT_FALSE(MakeLidarPattern("HDL-64").has_value());
}

}  // namespace
}  // namespace mlvi

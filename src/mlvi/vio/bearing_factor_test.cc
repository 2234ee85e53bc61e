// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/bearing_factor.h"

#include <gtest/gtest.h>

#include "mlvi/factors/factor_testing.h"
#include "mlvi/factors/pose_block.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

const PoseManifold kPoseManifold;

Eigen::VectorXd Block(const Pose3& pose) {
  Eigen::VectorXd block(kPoseBlockSize);
  StorePose(pose, block.data());
  return block;
}

struct Case {
  BearingPair pair;
  std::vector<FactorBlock> blocks;
};

// Of an image that is taken some centimetres and degrees before the stamp of its set.
ImageMotion RandomMotion(RandomStream& random) {
  return {.T_body_image = test::RandomPose(random, 0.03, 0.03), .twist = Vector6d::Random()};
}

// A point seen from two places (or by two cameras at one), with all that a factor depends on.
Case RandomCase(RandomStream& random, Compensation mode, bool same_frame, bool same_camera) {
  const PanoramaModel model =
      test::MakePanorama(test::RingRig(3, 0.25, test::MakeWideCamera(3.6)), {.radius = 1.5});
  while (true) {
    const Pose3 T_world_anchor = test::RandomPose(random, 3.0, 2.0);
    const Pose3 T_world_target =
        same_frame ? T_world_anchor : T_world_anchor * test::RandomPose(random, 0.4, 0.3);
    const Pose3 T_body_pano = test::RandomPose(random, 0.2, 0.4);
    const Eigen::Vector3d p_pano = random.Uniform(1.0, 15.0) * test::RandomDirection(random);
    const Eigen::Vector3d p_target =
        (T_world_target * T_body_pano).inverse() * (T_world_anchor * T_body_pano * p_pano);
    for (const CameraView& a : model.ViewsOfPoint(p_pano)) {
      for (const CameraView& t : model.ViewsOfPoint(p_target)) {
        const Eigen::Vector2d off = t.pixel + Eigen::Vector2d(1.0, -2.0);
        if ((a.camera == t.camera) != same_camera || !model.Usable(t.camera, off)) continue;
        Case c;
        c.pair = {.anchor = *model.Lift(a.camera, a.pixel),
                  .target = *model.Lift(t.camera, off),
                  .anchor_image = RandomMotion(random),
                  .target_image = RandomMotion(random),
                  .same_frame = same_frame,
                  .mode = mode,
                  .radius = 1.5,
                  .pixel_sigma = 0.7};
        if (!same_frame) {
          c.blocks.push_back({Block(T_world_anchor), &kPoseManifold});
          c.blocks.push_back({Block(T_world_target), &kPoseManifold});
        }
        c.blocks.push_back({Block(T_body_pano), &kPoseManifold});
        c.blocks.push_back({Block(model.T_pano_camera(a.camera)), &kPoseManifold});
        if (!same_camera)
          c.blocks.push_back({Block(model.T_pano_camera(t.camera)), &kPoseManifold});
        c.blocks.push_back(
            {Eigen::VectorXd::Constant(1, 1.0 / (p_pano - c.pair.anchor.center).norm())});
        for (int time = 0; time < (same_camera ? 1 : 2); ++time)
          c.blocks.push_back({Eigen::VectorXd::Constant(1, random.Uniform(-0.02, 0.02))});
        return c;
      }
    }
  }
}

class BearingFactorEveryMode : public ::testing::TestWithParam<Compensation> {};

// By poses at both ends, T_body_pano, extrinsics and time offsets of one or two cameras, inverse
// depth.
TEST_P(BearingFactorEveryMode, JacobiansAreCorrect) {
  RandomStream random(3, "bearing factor");
  for (int trial = 0; trial < 48; ++trial) {
    const bool same_frame = trial % 4 == 3, same_camera = trial % 2 == 0;
    const Case c = RandomCase(random, GetParam(), same_frame, same_camera);
    const BearingFactor factor(c.pair);
    EXPECT_TRUE(JacobiansAreCorrect(factor, c.blocks, 2e-6)) << "trial " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, BearingFactorEveryMode,
                         ::testing::Values(Compensation::kNone, Compensation::kPlane,
                                           Compensation::kRay));

}  // namespace
}  // namespace mlvi

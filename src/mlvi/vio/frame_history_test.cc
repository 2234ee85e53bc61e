// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/frame_history.h"

#include <gtest/gtest.h>

#include "mlvi/imu/imu_testing.h"

namespace mlvi {
namespace {

using mlvi::testing::Walk;

constexpr double kRate = 200.0;   // Hz, of the IMU
constexpr double kPeriod = 0.05;  // s, between frames

Time StampOf(int k) { return Walk::At(0.0023 + kPeriod * k); }

// Frames 0 .. last of the walk, with samples up to the newest one.
FrameHistory Filled(int last, double memory) {
  FrameHistory history(Duration::FromSeconds(memory));
  for (int k = 0; k <= last; ++k) {
    history.AddSamples(Walk().Samples(kPeriod * k, kPeriod * (k + 1), kRate));
    history.AddFrame(FrameId(k), StampOf(k));
  }
  return history;
}

TEST(FrameHistoryTest, KeepsItsMemoryCoveredBySamplesAndForgetsTheRest) {
  FrameHistory history = Filled(100, 1.0);
  EXPECT_EQ(history.Find(FrameId(79)), nullptr);
  ASSERT_NE(history.Find(FrameId(80)), nullptr);
  EXPECT_EQ(history.frames().size(), 21U);
  EXPECT_EQ(history.AddFrame(FrameId(101), StampOf(101)), FrameId(81));
  EXPECT_LE(history.samples().front().stamp, history.frames().front().stamp);
  EXPECT_GT(history.samples()[1].stamp, history.frames().front().stamp);
}

TEST(FrameHistoryTest, APauseLongerThanTheMemoryStaysCovered) {
  FrameHistory history = Filled(10, 1.0);
  history.AddSamples(Walk().Samples(0.55, 8.0, kRate));
  const Time after = Walk::At(7.9);
  history.AddFrame(FrameId(11), after);
  ASSERT_EQ(history.frames().size(), 2U);
  EXPECT_EQ(history.frames().front().id, FrameId(10));
  EXPECT_LE(history.samples().front().stamp, StampOf(10));
  EXPECT_GE(history.samples().back().stamp, after);
  // The next one forgets them.
  history.AddFrame(FrameId(12), Walk::At(7.95));
  EXPECT_EQ(history.frames().front().id, FrameId(11));
}

TEST(FrameHistoryTest, IgnoresSamplesThatItHas) {
  FrameHistory history(Duration::FromSeconds(1.0));
  const std::vector<ImuSample> samples = Walk().Samples(0.0, 0.5, kRate);
  history.AddSamples(samples);
  history.AddSamples(std::span(samples).subspan(40));
  ASSERT_EQ(history.samples().size(), samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    EXPECT_EQ(history.samples()[k].stamp, samples[k].stamp);
  }
}

class FrameHistoryMotion : public ::testing::Test {
 protected:
  // Truth: the pano frame at frame 9 in that of frame 3.
  Pose3 Truth() const {
    const auto pano = [this](int k) {
      return Walk().State(Walk::Seconds(StampOf(k))).T_world_body * T_body_pano_;
    };
    return pano(3).inverse() * pano(9);
  }
  FrameHistory history_ = Filled(10, 5.0);
  Pose3 T_body_pano_{ExpSo3({0.4, -1.1, 0.7}), Eigen::Vector3d(0.1, -0.05, 0.2)};
};

TEST_F(FrameHistoryMotion, IsThatOfThePosesWhereBothAreKnown) {
  for (const int k : {3, 9}) {
    history_.SetPose(FrameId(k), Walk().State(Walk::Seconds(StampOf(k))).T_world_body);
  }
  const PredictedMotion motion =
      history_.Motion(FrameId(3), FrameId(9), T_body_pano_, Eigen::Vector3d::Zero());
  ASSERT_TRUE(motion.t_earlier_current.has_value());
  EXPECT_LT(BoxMinus(Pose3(motion.R_earlier_current, *motion.t_earlier_current), Truth()).norm(),
            1e-12);
}

TEST_F(FrameHistoryMotion, IsTheRotationOfTheGyroscopeElse) {
  const Eigen::Vector3d bias(0.03, -0.02, 0.05);
  history_.SetPose(FrameId(3), Walk().State(Walk::Seconds(StampOf(3))).T_world_body);
  history_.SetPose(FrameId(9), Pose3());
  history_.ForgetPoses();
  const PredictedMotion motion =
      history_.Motion(FrameId(3), FrameId(9), T_body_pano_, Eigen::Vector3d::Zero());
  EXPECT_FALSE(motion.t_earlier_current.has_value());
  EXPECT_LT(motion.R_earlier_current.angularDistance(Truth().rotation()), 1e-4);
  // A bias of the gyroscope turns the result by its integral, 0.3 s of it.
  const PredictedMotion corrected = history_.Motion(FrameId(3), FrameId(9), T_body_pano_, bias);
  EXPECT_NEAR(corrected.R_earlier_current.angularDistance(motion.R_earlier_current),
              0.3 * bias.norm(), 0.02 * 0.3 * bias.norm());
}

TEST_F(FrameHistoryMotion, IsNoneBeyondTheMemory) {
  const PredictedMotion motion =
      history_.Motion(FrameId(-5), FrameId(9), T_body_pano_, Eigen::Vector3d::Zero());
  EXPECT_FALSE(motion.t_earlier_current.has_value());
  EXPECT_EQ(motion.R_earlier_current.w(), 1.0);
}

// In axes of the pano frame; identity where nothing was told, and for frames that are forgotten.
TEST_F(FrameHistoryMotion, ImagesHavePlacesOfTheirOwn) {
  const Pose3 moved(ExpSo3({0.01, -0.02, 0.03}), {0.01, 0.02, -0.01});
  history_.SetImagePlaces(FrameId(4), {Pose3(), moved});
  const Pose3 expected = T_body_pano_.inverse() * moved * T_body_pano_;
  EXPECT_LT(BoxMinus(history_.ImagePlace(FrameId(4), 1, T_body_pano_), expected).norm(), 1e-12);
  EXPECT_LT(BoxMinus(history_.ImagePlace(FrameId(4), 0, T_body_pano_), Pose3()).norm(), 1e-12);
  EXPECT_LT(BoxMinus(history_.ImagePlace(FrameId(5), 1, T_body_pano_), Pose3()).norm(), 1e-12);
  EXPECT_LT(BoxMinus(history_.ImagePlace(FrameId(99), 1, T_body_pano_), Pose3()).norm(), 1e-12);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/image_motion.h"

#include <gtest/gtest.h>

#include "mlvi/imu/imu_testing.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

using testing::kGravity;
using testing::TestImu;
using testing::Walk;

// The truth at an image's stamp follows from the state at the set's, for delays of up to half a
// period of 10 Hz, with the biases of the IMU and the velocity that the state tells.
TEST(ImageMotionTest, LeadsFromTheStateToTheImage) {
  const Walk walk;
  const ImuBias bias{.accelerometer = {0.1, -0.05, 0.2}, .gyroscope = {0.01, 0.02, -0.015}};
  std::vector<ImuSample> samples = walk.Samples(0.0, 2.0, 1000.0);
  for (ImuSample& sample : samples) {
    sample.angular_velocity += bias.gyroscope;
    sample.linear_acceleration += bias.accelerometer;
  }
  for (const double ms : {0.0, -0.3, -7.0, -20.0, -50.0}) {
    const double seconds = 1.2345;
    NavState frame = walk.State(seconds);
    frame.bias = bias;
    const NavState image = walk.State(seconds + 1e-3 * ms);
    // Integrated at other biases than those that the state has come to since.
    const ImuBias then{.accelerometer = {0.0, 0.0, 0.1}, .gyroscope = {0.005, 0.015, -0.01}};
    const ImageTiming timing =
        TimeImage(samples, Walk::At(seconds), Duration::FromSeconds(1e-3 * ms), then, TestImu());
    const ImageMotion motion = MotionOfImage(timing, frame, kGravity);
    const ImagePlace place(frame.T_world_body, motion, 0.0);
    const Vector6d error = BoxMinus(place.T_world_image, image.T_world_body);
    EXPECT_LT(error.head<3>().norm(), 2e-6) << ms << " ms";
    EXPECT_LT(error.tail<3>().norm(), 2e-5) << ms << " ms";
    const Eigen::Vector3d velocity = image.T_world_body.rotation().conjugate() * image.v_world_body;
    EXPECT_LT((motion.twist.head<3>() - velocity).norm(), 1e-3) << ms << " ms";
  }
}

// A body in steady motion is exactly where the time offset leads it.
TEST(ImageMotionTest, TimeOffsetsAreExactForSteadyMotion) {
  const Vector6d twist = (Vector6d() << 0.5, -1.0, 0.2, 0.3, -0.1, 0.4).finished();
  RandomStream random(5, "twist");
  const Pose3 pose = test::RandomPose(random, 2.0, 1.0);
  const ImagePlace place(pose, {.T_body_image = {}, .twist = twist}, 0.01);
  EXPECT_LT((BoxMinus(place.T_world_image, pose) - 0.01 * twist).norm(), 1e-12);
  EXPECT_FALSE(ImagePlace(pose, {.T_body_image = {}, .twist = twist}, 0.0).moved);
}

TEST(ImageMotionTest, DerivativesAreThoseOfThePlace) {
  RandomStream random(7, "place");
  constexpr double kStep = 1e-6;
  for (int trial = 0; trial < 20; ++trial) {
    const Pose3 pose = test::RandomPose(random, 2.0, 1.0);
    const ImageMotion motion{.T_body_image = test::RandomPose(random, 0.2, 0.3),
                             .twist = Vector6d::Random()};
    const double offset = random.Uniform(-0.03, 0.03);
    const ImagePlace place(pose, motion, offset);
    const auto difference = [&](const ImagePlace& more, const ImagePlace& less) {
      return Vector6d((BoxMinus(more.T_world_image, place.T_world_image) -
                       BoxMinus(less.T_world_image, place.T_world_image)) /
                      (2.0 * kStep));
    };
    for (int i = 0; i < 6; ++i) {
      const Vector6d d = kStep * Vector6d::Unit(i);
      EXPECT_LT((difference({BoxPlus(pose, d), motion, offset},
                            {BoxPlus(pose, Vector6d(-d)), motion, offset}) -
                 place.by_pose.col(i))
                    .norm(),
                1e-8);
    }
    EXPECT_LT((difference({pose, motion, offset + kStep}, {pose, motion, offset - kStep}) -
               place.by_time_offset)
                  .norm(),
              1e-8);
  }
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "mlvi/base/random.h"
#include "mlvi/sensors/camera_model.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/visible_share.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

Rig ValidRig() {
  Rig rig;
  rig.name = "test";
  rig.imu.topic = "/imu";
  rig.imu.rate_hz = 200.0;
  rig.imu.noise = {1e-3, 2e-4, 3e-5, 8e-6};
  rig.lidar.emplace();
  rig.lidar->topic = "/points";
  CameraSpec camera;
  camera.name = "cam0";
  camera.topic = "/cam0";
  camera.model = *MakeCameraModel("equidistant", 720, 540, {350, 350, 360, 270}, {0, 0, 0, 0});
  rig.cameras.push_back(camera);
  return rig;
}

TEST(Rig, ValidOnePasses) { EXPECT_TRUE(ValidRig().Validate()); }

// Spoils one value at a time; the message must name the field.
TEST(Rig, EachImpossibleValueIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<std::string, std::function<void(Rig&)>>> cases = {
      {"name", [](Rig& r) { r.name.clear(); }},
      {"gravity", [](Rig& r) { r.gravity = -9.81; }},
      {"gravity", [&](Rig& r) { r.gravity = nan; }},
      {"imu.topic", [](Rig& r) { r.imu.topic.clear(); }},
      {"imu.rate_hz", [](Rig& r) { r.imu.rate_hz = 0.0; }},
      {"imu.noise.accelerometer_density", [](Rig& r) { r.imu.noise.accelerometer_density = 0.0; }},
      {"imu.noise.gyroscope_density", [&](Rig& r) { r.imu.noise.gyroscope_density = nan; }},
      {"imu.noise.accelerometer_random_walk",
       [](Rig& r) { r.imu.noise.accelerometer_random_walk = -1.0; }},
      {"imu.noise.gyroscope_random_walk", [](Rig& r) { r.imu.noise.gyroscope_random_walk = -1.0; }},
      {"imu.initial_accelerometer_bias_sigma",
       [](Rig& r) { r.imu.initial_accelerometer_bias_sigma = -1.0; }},
      {"imu.initial_gyroscope_bias_sigma",
       [](Rig& r) { r.imu.initial_gyroscope_bias_sigma = -1.0; }},
      {"imu.time_offset_s", [](Rig& r) { r.imu.time_offset = Duration::FromSeconds(3600.0); }},
      {"lidar.topic", [](Rig& r) { r.lidar->topic.clear(); }},
      {"same", [](Rig& r) { r.lidar->topic = r.imu.topic; }},
      {"lidar.rate_hz", [](Rig& r) { r.lidar->rate_hz = 0.0; }},
      {"lidar.rings", [](Rig& r) { r.lidar->rings = -1; }},
      {"lidar.max_range", [](Rig& r) { r.lidar->max_range = r.lidar->min_range; }},
      {"lidar.T_body_lidar",
       [&](Rig& r) {
         r.lidar->T_body_lidar = Pose3::FromTranslation({nan, 0, 0});
       }},
      {"lever arm",
       [](Rig& r) {
         r.lidar->T_body_lidar = Pose3::FromTranslation({370.0, 0, 0});
       }},
      {"cameras[0].model", [](Rig& r) { r.cameras[0].model = nullptr; }},
      {"cameras[0].topic", [](Rig& r) { r.cameras[0].topic.clear(); }},
      {"both 'cam0'", [](Rig& r) { r.cameras.push_back(r.cameras[0]); }},
      {"T_body_groundtruth",
       [&](Rig& r) {
         r.T_body_groundtruth = Pose3::FromTranslation({0, nan, 0});
       }},
      {"p_body_pano", [&](Rig& r) { r.p_body_pano = Eigen::Vector3d(0, 0, nan); }},
  };
  for (const auto& [field, spoil] : cases) {
    Rig rig = ValidRig();
    spoil(rig);
    const auto valid = rig.Validate();
    ASSERT_FALSE(valid) << field;
    EXPECT_THAT(valid.error().message, HasSubstr(field));
    EXPECT_EQ(valid.error().kind, ErrorKind::kConfiguration);
  }
}

TEST(Rig, AMaskThatLeavesNothingIsRefusedAndTheWayOutIsNamed) {
  Rig rig = ValidRig();
  CameraSpec& camera = rig.cameras[0];
  Image mask{.width = 720, .height = 540, .pixels = std::vector<std::uint8_t>(720 * 540)};
  camera.mask = std::make_shared<const Image>(mask);
  ASSERT_FALSE(rig.Validate());
  EXPECT_THAT(rig.Validate().error().message,
              HasSubstr("the mask of cam0 leaves nothing visible: 0 of its 720 x 540 px are not 0; "
                        "zero is what is not used: invert the mask"));
  mask.pixels[0] = 255;  // the corner
  camera.mask = std::make_shared<const Image>(mask);
  EXPECT_TRUE(rig.Validate());
  camera.valid_radius_px = 300.0;
  ASSERT_FALSE(rig.Validate());
  EXPECT_THAT(
      rig.Validate().error().message,
      HasSubstr("1 of its 720 x 540 px are not 0, none of them within valid_radius_px = 300"));
  camera.mask = nullptr;
  EXPECT_TRUE(rig.Validate());
}

TEST(VisibleShare, IsWhatMaskAndValidRadiusLeave) {
  CameraSpec camera = ValidRig().cameras[0];
  EXPECT_EQ(VisibleShare(camera), 1.0);
  camera.valid_radius_px = 200.0;
  // Pixels of a disc: its area, but for half a pixel around at most.
  const double disc = M_PI * 200.0 * 200.0 / (720.0 * 540.0);
  EXPECT_NEAR(VisibleShare(camera), disc, disc * 0.5 * 2.0 / 200.0);
  Image mask{.width = 720, .height = 540, .pixels = std::vector<std::uint8_t>(720 * 540, 1)};
  std::fill_n(mask.pixels.begin(), 720 * 270, std::uint8_t{0});  // the upper half
  camera.mask = std::make_shared<const Image>(mask);
  EXPECT_NEAR(VisibleShare(camera), 0.5 * disc, 0.5 * disc * 0.02);
}

TEST(RotationFromMatrix, KeepsRotationsAndMendsRounding) {
  RandomStream random(3);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector4d v(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    const Eigen::Quaterniond q(v.normalized());
    const auto exact = RotationFromMatrix(q.toRotationMatrix(), "R");
    ASSERT_TRUE(exact);
    EXPECT_LT((exact->toRotationMatrix() - q.toRotationMatrix()).norm(), 1e-14);
    // Four decimals, as URDF files have them.
    const Eigen::Matrix3d rounded = (q.toRotationMatrix() * 1e4).array().round() * 1e-4;
    const auto mended = RotationFromMatrix(rounded, "R");
    ASSERT_TRUE(mended) << mended.error().message;
    EXPECT_LT((mended->toRotationMatrix() - q.toRotationMatrix()).norm(), 3.0 * 0.5e-4);
    EXPECT_NEAR(mended->norm(), 1.0, 1e-15);
  }
}

TEST(RotationFromMatrix, SaysWhatIsWrong) {
  // A published calibration has this.
  Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1).asDiagonal();
  EXPECT_THAT(RotationFromMatrix(mirror, "T.R").error().message,
              HasSubstr("T.R: determinant -1.0000"));
  EXPECT_THAT(RotationFromMatrix(2.0 * Eigen::Matrix3d::Identity(), "R").error().message,
              HasSubstr("not a rotation"));
  EXPECT_THAT(RotationFromMatrix(Eigen::Matrix3d::Zero(), "R").error().message,
              HasSubstr("not a rotation"));
  Eigen::Matrix3d poisoned = Eigen::Matrix3d::Identity();
  poisoned(1, 2) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(RotationFromMatrix(poisoned, "R").error().message, HasSubstr("not finite"));
}

}  // namespace
}  // namespace mlvi

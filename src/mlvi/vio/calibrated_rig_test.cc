// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibrated_rig.h"

#include <gtest/gtest.h>

namespace mlvi {
namespace {

// What was estimated goes to the cameras of that name; sensors that took no part stay as they are.
TEST(CalibratedRigTest, ChangesTheCamerasThatTookPart) {
  Rig rig;
  rig.lidar = LidarSpec();
  rig.cameras.resize(3);
  for (int i = 0; i < 3; ++i) {
    CameraSpec& camera = rig.cameras[static_cast<std::size_t>(i)];
    camera.name = "cam" + std::to_string(i);
    camera.time_offset = Duration::FromMilliseconds(i);
  }
  VioCalibration calibration;
  calibration.T_body_pano = Pose3(ExpSo3({0.1, 0.0, 0.0}), {1.0, 0.0, 0.0});
  calibration.T_pano_camera = {Pose3::FromTranslation({0.0, 2.0, 0.0}), Pose3()};
  calibration.time_offsets = {0.004, -0.0005};
  const std::vector<std::string> names = {"cam2", "cam0"};
  const Rig result = CalibratedRig(rig, names, calibration);
  ASSERT_EQ(result.cameras.size(), 3U);
  EXPECT_TRUE(result.lidar.has_value());
  EXPECT_EQ(result.cameras[2].time_offset.nanoseconds(), 6'000'000);
  EXPECT_EQ(result.cameras[0].time_offset.nanoseconds(), -500'000);
  EXPECT_EQ(result.cameras[1].time_offset, rig.cameras[1].time_offset);
  const Pose3 expected = calibration.T_body_pano * calibration.T_pano_camera[0];
  EXPECT_EQ(result.cameras[2].T_body_camera.matrix(), expected.matrix());
  EXPECT_EQ(result.cameras[1].T_body_camera.matrix(), rig.cameras[1].T_body_camera.matrix());
}

}  // namespace
}  // namespace mlvi

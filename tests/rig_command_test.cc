// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// `mlvi rig`: calibrations by Kalibr become rig files that mean the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "mlvi/io/kalibr_fixtures.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/sensors/camera_model.h"
#include "run_mlvi.h"
#include "temporary_folder.h"

#ifdef MLVI_BINARY

namespace mlvi {
namespace {

using test::kCamchain;
using test::kKalibrImu;
using test::ProcessResult;
using test::RunMlvi;
using ::testing::HasSubstr;
using ::testing::Not;

class RigCommand : public ::testing::Test {
 protected:
  RigCommand() {
    std::ofstream(Path("camchain.yaml")) << kCamchain;
    std::ofstream(Path("imu.yaml")) << kKalibrImu;
  }
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }
  ProcessResult Run(const std::string& arguments) const { return RunMlvi("rig " + arguments); }

  test::TemporaryFolder folder_{"rig"};
};

void ExpectTheCamerasOfTheChain(const Rig& rig) {
  ASSERT_GE(rig.cameras.size(), 2U);
  const CameraSpec &cam0 = rig.cameras[0], &cam1 = rig.cameras[1];
  EXPECT_EQ(cam0.topic, "/stereo/left");
  EXPECT_EQ(cam0.model->name(), "equidistant");
  EXPECT_EQ(cam1.model->name(), "mei");
  EXPECT_EQ(cam0.time_offset.nanoseconds(), -1'800'000);
  // A point 2 m ahead of cam0 on its axis, and the same point seen by cam1, in the frame of the
  // IMU.
  EXPECT_LT(
      (cam0.T_body_camera * Eigen::Vector3d(0, 0, 2) - Eigen::Vector3d(2.07, 0.05, -0.02)).norm(),
      1e-9);
  EXPECT_LT((cam1.T_body_camera * Eigen::Vector3d(-0.11, 0, 2) - Eigen::Vector3d(2.07, 0.05, -0.02))
                .norm(),
            1e-9);
}

TEST_F(RigCommand, CamerasAndImuMakeARig) {
  const ProcessResult result = Run("--kalibr " + Path("camchain.yaml") + " --kalibr-imu " +
                                   Path("imu.yaml") + " -o " + Path("stereo.yaml"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_THAT(result.output,
              HasSubstr("at (0.070, 0.050, -0.020) m, looking along (1.00, 0.00, 0.00)"));
  const auto rig = LoadRig(Path("stereo.yaml"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->name, "stereo");
  EXPECT_FALSE(rig->lidar);
  EXPECT_EQ(rig->cameras.size(), 2U);
  ExpectTheCamerasOfTheChain(*rig);
  EXPECT_EQ(rig->imu.topic, "/imu0");
  EXPECT_EQ(rig->imu.rate_hz, 400.0);
  EXPECT_EQ(rig->imu.noise.accelerometer_density, 0.019);
  EXPECT_EQ(rig->imu.noise.gyroscope_random_walk, 0.000266);
}

TEST_F(RigCommand, TheBaseKeepsWhatTheCalibrationDoesNotTell) {
  const Rig base = *LoadRig("newer_college");
  const ProcessResult result = Run("--base newer_college --kalibr " + Path("camchain.yaml") +
                                   " --name mine -o " + Path("rig.yaml"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto rig = LoadRig(Path("rig.yaml"));
  ASSERT_TRUE(rig) << rig.error().message;
  EXPECT_EQ(rig->name, "mine");
  ExpectTheCamerasOfTheChain(*rig);
  ASSERT_TRUE(rig->lidar);
  EXPECT_EQ(rig->lidar->topic, base.lidar->topic);
  EXPECT_EQ(rig->lidar->T_body_lidar.matrix(), base.lidar->T_body_lidar.matrix());
  EXPECT_EQ(rig->imu.topic, base.imu.topic);
  EXPECT_EQ(rig->cameras[0].rate_hz, base.cameras[0].rate_hz);
  ASSERT_EQ(rig->cameras.size(), base.cameras.size());
  EXPECT_EQ(rig->cameras[2].topic, base.cameras[2].topic);
  EXPECT_THAT(result.output,
              HasSubstr("(from newer_college)"));  // cameras that the chain does not have
}

TEST_F(RigCommand, ABuiltInRigIsPrintedAsAFile) {
  const ProcessResult result = Run("--base m2dgr >" + Path("copy.yaml"));
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const auto copy = LoadRig(Path("copy.yaml"));
  ASSERT_TRUE(copy) << copy.error().message;
  EXPECT_EQ(RigToYaml(*copy), RigToYaml(*LoadRig("m2dgr")));
}

TEST(Documents, NameEveryBuiltInRig) {
  for (const char* page : {"README.md", "docs/rigs.md"}) {
    const std::string text = test::ReadFile(std::filesystem::path(MLVI_SOURCE_DIR) / page);
    for (const std::string& name : BuiltinRigNames())
      EXPECT_THAT(text, HasSubstr("`" + name + "`")) << page;
  }
}

TEST_F(RigCommand, WrongUseAndWrongFilesSayWhatIsMissing) {
  const ProcessResult no_imu = Run("--kalibr " + Path("camchain.yaml"));
  EXPECT_EQ(no_imu.exit_code, 1);
  EXPECT_THAT(no_imu.output, HasSubstr("--kalibr-imu"));
  std::string chain = kCamchain;
  chain.replace(chain.find("T_cam_imu"), 9, "T_imu_cam");
  std::ofstream(Path("camchain.yaml")) << chain;
  const ProcessResult reversed =
      Run("--base m2dgr --kalibr " + Path("camchain.yaml") + " -o " + Path("rig.yaml"));
  EXPECT_EQ(reversed.exit_code, 1);
  EXPECT_THAT(reversed.output, HasSubstr("missing field 'cam0.T_cam_imu'"));
  EXPECT_FALSE(std::filesystem::exists(Path("rig.yaml")));
  const ProcessResult nowhere = Run("--base m2dgr -o " + Path("no/such/folder/rig.yaml"));
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.output, HasSubstr("cannot write"));
}

}  // namespace
}  // namespace mlvi

#endif

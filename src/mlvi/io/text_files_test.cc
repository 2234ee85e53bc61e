// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Trajectories, EuRoC tables, Kalibr and configuration files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "mlvi/io/bag_fixtures.h"
#include "mlvi/io/config_file.h"
#include "mlvi/io/euroc.h"
#include "mlvi/io/kalibr.h"
#include "mlvi/io/kalibr_fixtures.h"
#include "mlvi/io/ply.h"
#include "mlvi/io/raw_bag_writer.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/tum.h"
#include "mlvi/io/whole_file.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

using test::kCamchain;
using ::testing::HasSubstr;

TEST(WholeFile, ComesBackByteByByte) {
  std::string bytes;
  for (int i = 0; i < 200'000; ++i) bytes += static_cast<char>(i * 7 % 256);
  const std::string path = test::TemporaryPath("bytes");
  ASSERT_TRUE(WriteWholeFile(path, bytes));
  EXPECT_TRUE(ReadWholeFile(path, ErrorKind::kInput).value() == bytes);
  ASSERT_TRUE(WriteWholeFile(path, ""));
  EXPECT_EQ(ReadWholeFile(path, ErrorKind::kInput).value(), "");
}

TEST(WholeFile, WhatCannotBeReadIsAnErrorOfTheKindAskedFor) {
  for (const ErrorKind kind : {ErrorKind::kInput, ErrorKind::kConfiguration}) {
    EXPECT_EQ(ReadWholeFile("/nowhere/at/all", kind).error().kind, kind);
    EXPECT_EQ(ReadWholeFile(::testing::TempDir(), kind).error().kind, kind);
  }
}

// Every writer, onto a place that takes nothing and into a folder that is not there.
TEST(WholeFile, WritersReportOneKindOfError) {
  const Rig rig = test::MakeRig("OS0-128", 128);
  const auto expect = [](const Expected<void>& written, const char* what) {
    ASSERT_FALSE(written) << what;
    EXPECT_EQ(written.error().kind, ErrorKind::kConfiguration) << what;
    EXPECT_THAT(written.error().message, HasSubstr("cannot write '/")) << what;
  };
  for (const std::string path : {"/dev/full", "/nowhere/at/all.png"}) {
    if (path == "/dev/full" && !std::filesystem::exists(path)) continue;
    expect(WriteWholeFile(path, "text"), "bytes");
    expect(WriteTum({{.stamp = test::kStart, .pose = Pose3()}}, path), "trajectory");
    expect(SaveRig(rig, path), "rig");
    expect(WritePly(std::vector<PlyPoint>(10), path), "cloud");
    // The file is first written to when it is closed, or when it is left without that.
    for (const bool close : {true, false}) {
      auto bag = RawBagWriter::Create(path, BagCompression::kNone);
      if (!bag) {
        expect(tl::unexpected(bag.error()), "bag");
        continue;
      }
      const Expected<void> sent =
          (*bag)->Write("/imu", test::kStart, ImuMessage({.stamp = test::kStart}));
      if (sent && close) expect((*bag)->Close(), "bag");
    }
  }
}

TEST(Tum, RoundTripIsExactInTime) {
  Trajectory sent;
  RandomStream random(1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector4d q(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    sent.push_back({.stamp = test::kStart + Duration::FromNanoseconds(100'000'001) * i,
                    .pose = Pose3(Eigen::Quaterniond(q),
                                  {random.Normal(), random.Normal(), random.Normal()})});
  }
  sent[7].has_rotation = false;
  sent[7].pose = Pose3::FromTranslation({1, 2, 3});
  const std::string path = test::TemporaryPath("trajectory.tum");
  ASSERT_TRUE(WriteTum(sent, path, "the frame"));
  const auto read = ReadTum(path);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp, sent[i].stamp);
    EXPECT_EQ((*read)[i].has_rotation, i != 7);
    EXPECT_LT(((*read)[i].pose.translation() - sent[i].pose.translation()).norm(), 1e-6);
    EXPECT_LT(((*read)[i].pose.R() - sent[i].pose.R()).norm(), 1e-8);
  }
}

TEST(Tum, ErrorsNameTheLine) {
  EXPECT_THAT(ParseTum("# c\n\n1 2 3\n", "t").error().message, HasSubstr("t:3: 3 columns"));
  EXPECT_THAT(ParseTum("1 0 0 0 0 0 0 1\n1.5 0 0 nan 0 0 0 1\n", "t").error().message,
              HasSubstr("t:2: 'nan' in column 4"));
  EXPECT_THAT(ParseTum("1 0 0 0 0 0 0 2\n", "t").error().message,
              HasSubstr("quaternion norm 2.0000"));
  EXPECT_THAT(ParseTum("1403715273262142976 0 0 0 0 0 0 1\n", "t").error().message,
              HasSubstr("in nanoseconds?"));
  EXPECT_THAT(ParseTum("# nothing\n", "t").error().message, HasSubstr("no pose"));
  EXPECT_THAT(ReadTum("/nowhere/t").error().message, HasSubstr("does the file exist"));
}

TEST(Tum, ReadsPublishedFiles) {
  for (const char* name : {"walk_os0/groundtruth.tum", "evo/fr2_desk_groundtruth.txt",
                           "evo/freiburg1_xyz-rgbdslam.txt"}) {
    const std::string path = test::SharedData(name);
    MLVI_SKIP_WITHOUT(path);
    const auto read = ReadTum(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_GT(read->size(), 70u);
  }
}

TEST(Euroc, ReadsTheRecording) {
  const std::string imu_path = test::SharedData("euroc_v1_01/imu.csv");
  MLVI_SKIP_WITHOUT(imu_path);
  const auto imu = ReadEurocImu(imu_path);
  ASSERT_TRUE(imu) << imu.error().message;
  EXPECT_EQ(imu->front().stamp.nanoseconds(), 1403715273262142976);
  EXPECT_EQ(imu->front().linear_acceleration.x(), 9.0874956666666655);
  EXPECT_NEAR((imu->back().stamp - imu->front().stamp).seconds(), 145.0, 2.0);
  const auto truth = ReadEurocGroundTruth(test::SharedData("euroc_v1_01/groundtruth.csv"));
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_EQ(truth->front().T_world_body.translation(), Eigen::Vector3d(0.878895, 2.1834, 0.948427));
  EXPECT_NEAR(truth->front().T_world_body.rotation().w(), 0.069433, 1e-6);
  EXPECT_EQ(truth->front().bias.gyroscope.z(), 0.0770299);
  EXPECT_EQ(truth->front().bias.accelerometer.x(), -0.0180115);
  // At rest, gravity in the body frame is minus the measured force: axes and order of the
  // quaternion are right.
  const Eigen::Vector3d force =
      truth->front().T_world_body.rotation() *
      (imu->front().linear_acceleration - truth->front().bias.accelerometer);
  EXPECT_LT((force - Eigen::Vector3d(0, 0, 9.81)).norm(), 0.5);
}

TEST(Kalibr, CamchainBecomesCameras) {
  Rig rig = test::MakeRig("OS0-128", 128);
  const auto names = ImportKalibrCamchainText(kCamchain, "camchain.yaml", rig);
  ASSERT_TRUE(names) << names.error().message;
  EXPECT_EQ(*names, (std::vector<std::string>{"cam0", "cam1"}));
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_TRUE(rig.Validate()) << rig.Validate().error().message;
  EXPECT_EQ(rig.cameras[0].model->name(), "equidistant");
  EXPECT_EQ(rig.cameras[1].model->name(), "mei");
  EXPECT_EQ(rig.cameras[0].time_offset.nanoseconds(), -1'800'000);
  // The optical axis is the IMU's x axis, and T_cam_imu maps the camera's centre to zero.
  const Pose3& T_body_cam0 = rig.cameras[0].T_body_camera;
  EXPECT_LT((T_body_cam0.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
            1e-12);
  EXPECT_LT((T_body_cam0.translation() - Eigen::Vector3d(0.07, 0.05, -0.02)).norm(), 1e-12);
  // cam1 is 0.11 m along the x axis of cam0.
  const Pose3 T_cam0_cam1 = T_body_cam0.inverse() * rig.cameras[1].T_body_camera;
  EXPECT_LT((T_cam0_cam1.translation() - Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-12);
  const auto read = ParseRig(RigToYaml(rig), "written");
  ASSERT_TRUE(read) << read.error().message;
}

TEST(Kalibr, ErrorsLeaveTheRigAlone) {
  Rig rig = test::MakeRig("OS0-128", 128);
  std::string chain = kCamchain;
  chain.replace(chain.find("T_cam_imu"), 9, "T_imu_cam");
  const auto imported = ImportKalibrCamchainText(chain, "camchain.yaml", rig);
  ASSERT_FALSE(imported);
  EXPECT_THAT(imported.error().message, HasSubstr("missing field 'cam0.T_cam_imu'"));
  EXPECT_TRUE(rig.cameras.empty());
  chain = kCamchain;
  chain.replace(chain.find("equidistant"), 11, "fov");
  EXPECT_THAT(ImportKalibrCamchainText(chain, "c", rig).error().message,
              HasSubstr("is not supported"));
}

TEST(Kalibr, ImuNoise) {
  Rig rig = test::MakeRig("OS0-128", 128);
  ASSERT_TRUE(ImportKalibrImuText(test::kKalibrImu, "imu.yaml", rig));
  EXPECT_EQ(rig.imu.noise.accelerometer_density, 0.019);
  EXPECT_EQ(rig.imu.noise.accelerometer_random_walk, 0.0043);
  EXPECT_EQ(rig.imu.noise.gyroscope_density, 0.002);
  EXPECT_EQ(rig.imu.noise.gyroscope_random_walk, 0.000266);
  EXPECT_EQ(rig.imu.rate_hz, 400.0);
  EXPECT_EQ(rig.imu.topic, "/imu0");
}

struct TestConfig {
  double size = 1.0;
  bool on = false;
  struct Inner {
    int count = 3;
    void Declare(ConfigDeclaration& d) { d.Field("count", count, "", "why", {0, 10}); }
  } inner;
  void Declare(ConfigDeclaration& d) {
    d.Field("size", size, "m", "why", {0.0, 5.0});
    d.Field("on", on, "why");
    d.Section("inner", inner);
  }
};

TEST(ConfigFile, NestedAndDottedKeys) {
  for (const char* text :
       {"size: 2.5\non: true\ninner: {count: 7}\n", "{size: 2.5, on: true, inner.count: 7}"}) {
    TestConfig config;
    ConfigDeclaration declaration = ConfigDeclaration::Of(config);
    ASSERT_TRUE(ApplyConfigText(text, "c.yaml", declaration));
    EXPECT_EQ(config.size, 2.5);
    EXPECT_TRUE(config.on);
    EXPECT_EQ(config.inner.count, 7);
    // The dump is a configuration file.
    TestConfig again;
    ConfigDeclaration other = ConfigDeclaration::Of(again);
    ASSERT_TRUE(ApplyConfigText(declaration.ToYaml(), "dump", other));
    EXPECT_EQ(again.inner.count, 7);
  }
}

TEST(ConfigFile, Errors) {
  TestConfig config;
  ConfigDeclaration declaration = ConfigDeclaration::Of(config);
  const auto error = [&](const char* text) {
    return ApplyConfigText(text, "c.yaml", declaration).error().message;
  };
  EXPECT_THAT(
      error("size: 1\ninner:\n  cuont: 2\n"),
      HasSubstr("c.yaml:3: unknown configuration key 'inner.cuont'; did you mean 'inner.count'?"));
  EXPECT_THAT(error("size: 9"), HasSubstr("must be finite and in [0, 5]"));
  EXPECT_THAT(error("inner: {count: 1}\ninner.count: 2"), HasSubstr("given twice"));
  EXPECT_THAT(error("size: [1]"), HasSubstr("expected a value"));
  EXPECT_THAT(error("just text"), HasSubstr("expected a map"));
  EXPECT_TRUE(ApplyConfigText("# nothing\n", "c.yaml", declaration));
  EXPECT_THAT(ApplyConfigFile("/nowhere.yaml", declaration).error().message,
              HasSubstr("does the file exist"));
  EXPECT_THAT(ApplyConfigFile(::testing::TempDir(), declaration).error().message,
              HasSubstr("it is a folder"));
}

}  // namespace
}  // namespace mlvi

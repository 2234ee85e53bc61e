// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Maps as PLY and as pictures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "mlvi/io/bag_fixtures.h"
#include "mlvi/io/map_picture.h"
#include "mlvi/io/ply.h"

namespace mlvi {
namespace {

using ::testing::HasSubstr;

TEST(Ply, RoundTrip) {
  RandomStream random(1);
  for (const int count : {0, 1, 1234}) {
    std::vector<PlyPoint> sent(static_cast<std::size_t>(count));
    for (PlyPoint& point : sent) {
      point.position =
          Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).cast<float>();
      point.intensity = static_cast<float>(random.Uniform());
    }
    const std::string path = test::TemporaryPath("map.ply");
    ASSERT_TRUE(WritePly(sent, path, "world frame"));
    const auto read = ReadPly(path);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i) {
      EXPECT_EQ((*read)[i].position, sent[i].position);
      EXPECT_EQ((*read)[i].intensity, sent[i].intensity);
    }
  }
}

TEST(Ply, ReadsDoublesAndOtherProperties) {
  std::string file =
      "ply\r\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar red\nproperty "
      "double x\n"
      "property double y\nproperty float z\nelement face 0\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  const double x = 1.5, y = -2.25;
  const float z = 8.0F;
  file += '\xff';
  file.append(reinterpret_cast<const char*>(&x), 8).append(reinterpret_cast<const char*>(&y), 8);
  file.append(reinterpret_cast<const char*>(&z), 4);
  const std::string path = test::TemporaryPath("other.ply");
  test::WriteBytes(path, {file.begin(), file.end()});
  const auto read = ReadPly(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->at(0).position, Eigen::Vector3f(1.5F, -2.25F, 8.0F));
}

TEST(Ply, Errors) {
  const std::string path = test::TemporaryPath("bad.ply");
  const auto error = [&](const std::string& text) {
    test::WriteBytes(path, {text.begin(), text.end()});
    const auto read = ReadPly(path);
    return read ? "no error" : read.error().message;
  };
  EXPECT_THAT(error("pcd"), HasSubstr("is no PLY file"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\n"), HasSubstr("format 'ascii'"));
  EXPECT_THAT(error("ply\nformat binary_little_endian 1.0\n"), HasSubstr("does not end"));
  EXPECT_THAT(
      error(
          "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n"),
      HasSubstr("no float properties x, y, z"));
  EXPECT_THAT(error("ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty "
                    "float x\nproperty float y\n"
                    "property float z\nend_header\nabc"),
              HasSubstr("only 3 bytes follow"));
  EXPECT_FALSE(PlyWriter::Create("/nowhere/map.ply"));
}

TEST(MapPicture, ShowsPointsAndTrajectory) {
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i) {
    trajectory.push_back(
        {.stamp = test::kStart, .pose = Pose3::FromTranslation({0.1 * i, 5.0, 0.0})});
  }
  MapPicture picture(trajectory);
  for (int i = 0; i < 20000; ++i) picture.Add({0.0005 * i, 0.0, 1.0});  // a wall along x at y = 0
  picture.Add({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0});
  const std::string path = test::TemporaryPath("map.png");
  ASSERT_TRUE(picture.Save(path, 800));
  const cv::Mat image = cv::imread(path);
  ASSERT_EQ(image.cols, 800);
  ASSERT_EQ(image.rows, 437);  // 10 m x 4.95 m (centres of cells) at 72 px/m, and margins
  // y points up: the trajectory is at the top, green to red; the wall at the bottom, dark.
  const cv::Vec3b start = image.at<cv::Vec3b>(40, 60), end = image.at<cv::Vec3b>(40, 740);
  EXPECT_GT(start[1], start[2] + 50);
  EXPECT_GT(end[2], end[1] + 50);
  int dark = 0;
  for (int column = 40; column < 760; ++column) {
    dark += image.at<cv::Vec3b>(396, column)[0] < 120 || image.at<cv::Vec3b>(397, column)[0] < 120
                ? 1
                : 0;
  }
  EXPECT_GT(dark, 90);  // 100 cells of 0.1 m
  EXPECT_EQ(image.at<cv::Vec3b>(220, 400), cv::Vec3b(255, 255, 255));
  EXPECT_FALSE(picture.Save("/nowhere/map.png"));
  EXPECT_FALSE(MapPicture({}).Save(path));
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Images of several cameras from a bag: all that is sound arrives in order, all that is not is
// counted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mlvi/base/parallel.h"
#include "mlvi/io/bag_fixtures.h"
#include "mlvi/io/image_encoder.h"
#include "mlvi/io/raw_bag_writer.h"
#include "mlvi/io/ros_serialization.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

using test::kStart;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kWidth = 24, kHeight = 16, kSets = 40;

// Two cameras at 20 Hz (cam0 raw, cam1 JPEG) and an IMU at 200 Hz, no LiDAR.
class BagImages : public ::testing::Test {
 protected:
  BagImages() {
    rig_ = test::MakeRig("", 0);
    rig_.lidar.reset();
    for (const char* name : {"cam0", "cam1"}) {
      CameraSpec camera;
      camera.name = name;
      camera.topic = std::string("/") + name;
      camera.model =
          *MakeCameraModel("equidistant", kWidth, kHeight, {20, 20, 12, 8}, {0, 0, 0, 0});
      camera.time_offset = Duration::FromMilliseconds(2);
      rig_.cameras.push_back(camera);
    }
  }

  static Image Frame(int index, int width = kWidth) {
    Image image{.stamp = kStart + Duration::FromMilliseconds(50) * index,
                .width = width,
                .height = kHeight};
    image.pixels.assign(static_cast<std::size_t>(width * kHeight),
                        static_cast<std::uint8_t>(40 + 4 * index));
    return image;
  }
  static RosMessage Jpeg(const Image& image) {
    const auto bytes = EncodeJpeg(image, 90);
    EXPECT_TRUE(bytes);
    return CompressedImageMessage(image.stamp, "cam1", "mono8; jpeg compressed ", *bytes);
  }
  // `second`: cam1's message `index`.
  void Write(
      const std::function<RosMessage(int)>& second = [](int i) { return Jpeg(Frame(i)); },
      const std::string& second_topic = "/cam1") {
    auto writer = RawBagWriter::Create(path_, BagCompression::kNone);
    ASSERT_TRUE(writer);
    for (int i = 0; i < 10 * kSets; ++i) {
      const ImuSample imu = test::MakeImu(i);
      ASSERT_TRUE((*writer)->Write("/imu", imu.stamp, ImuMessage(imu)));
      if (i % 10 != 0) continue;
      const Image image = Frame(i / 10);
      ASSERT_TRUE((*writer)->Write("/cam0", imu.stamp, ImageMessage(image, "cam0")));
      ASSERT_TRUE((*writer)->Write(second_topic, imu.stamp, second(i / 10)));
    }
    ASSERT_TRUE((*writer)->Close());
  }
  test::Content Read(RosBagSourceOptions options) {
    options.use_lidar = false;
    auto source = RosBagSource::Open({path_}, rig_, options);
    EXPECT_TRUE(source) << source.error().message;
    return source ? test::ReadAll(**source) : test::Content();
  }
  test::Content ReadBoth() { return Read({.cameras = {"cam0", "cam1"}}); }

  Rig rig_;
  std::string path_ = test::TemporaryPath("images.bag");
};

TEST_F(BagImages, ArriveInOrderWithTheirStampsAndCamerasAtAnyNumberOfThreads) {
  Write();
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    const test::Content content = ReadBoth();
    EXPECT_EQ(content.error, "");
    ASSERT_EQ(content.imu.size(), 10U * kSets);
    ASSERT_EQ(content.images.size(), 2U * kSets);
    for (int i = 0; i < 2 * kSets; ++i) {
      const Image& image = content.images[static_cast<std::size_t>(i)];
      EXPECT_EQ(image.camera, i % 2);
      EXPECT_EQ(image.stamp, Frame(i / 2).stamp + Duration::FromMilliseconds(2));
      EXPECT_NEAR(image.pixels[100], Frame(i / 2).pixels[100], 1);  // JPEG
    }
  }
}

TEST_F(BagImages, UndecodableAndMissizedOnesAreCountedAndTheOtherCameraGoesOn) {
  Write([](int i) {
    if (i % 4 == 1)
      return CompressedImageMessage(Frame(i).stamp, "cam1", "jpeg",
                                    std::vector<std::uint8_t>(60, 9));
    return Jpeg(Frame(i, i % 4 == 3 ? kWidth / 2 : kWidth));
  });
  const test::Content content = ReadBoth();
  EXPECT_EQ(content.error, "");
  EXPECT_EQ(content.counts.at("/cam0").delivered, kSets);
  const StreamCounts& counts = content.counts.at("/cam1");
  EXPECT_EQ(counts.messages, kSets);
  EXPECT_EQ(counts.delivered, kSets / 2);
  EXPECT_EQ(counts.dropped.at("unreadable message"), kSets / 4);
  EXPECT_EQ(counts.dropped.at("wrong size"), kSets / 4);
  EXPECT_THAT(content.notes,
              Contains(HasSubstr("/cam1: unreadable message: compressed image of 60 bytes")));
}

TEST_F(BagImages, ACameraOfTheWrongSizeThroughoutIsNoEndOfTheRecording) {
  Write([](int i) { return Jpeg(Frame(i, kWidth / 2)); });
  const test::Content content = ReadBoth();
  EXPECT_EQ(content.error, "");
  EXPECT_EQ(content.images.size(), static_cast<std::size_t>(kSets));
  EXPECT_THAT(content.notes,
              Contains(HasSubstr("image of 12 x 16 px, camera cam1 of rig 'test' has 24 x 16")));
  // On its own there is nothing left.
  EXPECT_THAT(Read({.cameras = {"cam1"}}).error,
              HasSubstr("no message of topic '/cam1' can be read"));
}

TEST_F(BagImages, AreThinnedToTheSameInstantsOfAllCamerasBeforeTheyAreDecoded) {
  Write();
  const test::Content content = Read({.cameras = {"cam0", "cam1"}, .max_image_rate = 10.0});
  ASSERT_EQ(content.images.size(), static_cast<std::size_t>(kSets));
  EXPECT_EQ(content.counts.at("/cam1").thinned, kSets / 2);
  for (std::size_t i = 0; i < content.images.size(); i += 2) {
    EXPECT_EQ(content.images[i].stamp, content.images[i + 1].stamp);
  }
}

TEST_F(BagImages, ACameraThatTheBagDoesNotHoldIsAnErrorOnlyWhenItIsRequired) {
  Write([](int i) { return Jpeg(Frame(i)); }, "/camera_one");
  const auto strict =
      RosBagSource::Open({path_}, rig_, {.use_lidar = false, .cameras = {"cam0", "cam1"}});
  ASSERT_FALSE(strict);
  EXPECT_THAT(strict.error().message, HasSubstr("camera topic '/cam1' of rig 'test' is not in"));
  const test::Content content = Read({.cameras = {"cam0", "cam1"}, .cameras_required = false});
  EXPECT_EQ(content.error, "");
  EXPECT_EQ(content.images.size(), static_cast<std::size_t>(kSets));
  EXPECT_THAT(content.notes, ElementsAre(HasSubstr("cam1: topic '/cam1' is not in the recording")));
}

}  // namespace
}  // namespace mlvi

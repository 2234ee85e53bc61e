// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/camera_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class CameraWatchTest : public ::testing::Test {
 protected:
  CameraWatchTest() {
    events_.Subscribe(
        [this](const Event& event) { messages_.push_back(event.source + " " + event.message); });
  }
  static Rig TwoCameras() {
    Rig rig;
    for (const char* name : {"left", "right"}) {
      rig.cameras.emplace_back();
      rig.cameras.back().name = name;
    }
    return rig;
  }
  static Time At(double seconds) { return Time::FromSeconds(10.0 + seconds); }
  // A picture of grey values around `level`, different each time.
  Image Picture(int camera, double stamp, double level = 120.0) {
    Image image{.stamp = At(stamp), .camera = camera, .width = 40, .height = 30};
    for (int i = 0; i < 1200; ++i) {
      image.pixels.push_back(
          static_cast<std::uint8_t>(std::clamp(level + 3.0 * random_.Normal(), 0.0, 255.0)));
    }
    return image;
  }
  // Hands over a set and returns the cameras left in it.
  std::vector<int> Inspect(std::vector<Image> images) {
    const Time stamp = images.back().stamp;
    std::vector<int> cameras;
    for (const Image& image : watch_.Inspect({stamp, std::move(images)}).images)
      cameras.push_back(image.camera);
    return cameras;
  }
  StreamReport Report(const std::string& camera) {
    watch_.Conclude();
    return watch_.Reports().at(camera);
  }

  EventBus events_;
  std::vector<std::string> messages_;
  CameraWatch watch_{CameraWatchConfig{}, TwoCameras(), events_};
  RandomStream random_{1};
};

TEST_F(CameraWatchTest, HealthyCamerasAreHealthy) {
  for (int i = 0; i < 30; ++i) {
    EXPECT_THAT(Inspect({Picture(0, 0.1 * i), Picture(1, 0.1 * i)}), ElementsAre(0, 1));
  }
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_EQ(Report("left").health.level, HealthLevel::kHealthy);
  EXPECT_EQ(Report("right").used, 30);
}

TEST_F(CameraWatchTest, FrozenPicturesAreTakenOutAndReportedOnce) {
  const Image frozen = Picture(1, 0.0);
  for (int i = 0; i < 30; ++i) {
    Image second = frozen;
    second.stamp = At(0.1 * i);
    if (i >= 20) second = Picture(1, 0.1 * i);
    EXPECT_EQ(Inspect({Picture(0, 0.1 * i), second}).size(), i == 0 || i >= 20 ? 2U : 1U) << i;
  }
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("right frozen: 5 times the same picture")));
  const StreamReport report = Report("right");
  EXPECT_EQ(report.used, 11);
  EXPECT_EQ(report.dropped.at("frozen: the same picture again"), 19);
  EXPECT_EQ(report.health.reason, "frozen in 19 of 30 images");
}

TEST_F(CameraWatchTest, ADarkCameraIsReportedButBlackIsNotFrozen) {
  for (int i = 0; i < 30; ++i) {
    Image black = Picture(1, 0.1 * i);
    std::fill(black.pixels.begin(), black.pixels.end(), 2);
    EXPECT_EQ(Inspect({Picture(0, 0.1 * i), black}).size(), 2U);
  }
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("right dark: 95 % of the picture")));
  EXPECT_EQ(Report("right").health.reason, "dark in 30 of 30 images");
}

// Now and then a picture that is dark or comes twice, never five in a row: no reason to warn.
TEST_F(CameraWatchTest, SingleDarkOrRepeatedPicturesAreNoFault) {
  Image before = Picture(1, 0.0);
  for (int i = 0; i < 100; ++i) {
    Image left = Picture(0, 0.1 * i), right = Picture(1, 0.1 * i);
    if (i % 10 == 3) std::fill(left.pixels.begin(), left.pixels.end(), 2);
    if (i % 10 == 5) right.pixels = before.pixels;
    before = right;
    Inspect({left, right});
  }
  EXPECT_THAT(messages_, IsEmpty());
  EXPECT_EQ(Report("left").health.level, HealthLevel::kHealthy);
  EXPECT_EQ(Report("right").dropped.at("frozen: the same picture again"), 10);
  EXPECT_EQ(Report("right").health.level, HealthLevel::kHealthy);
}

TEST_F(CameraWatchTest, ADeadCameraIsReportedWhenItIsSilentAndHasFailed) {
  for (int i = 0; i < 60; ++i) {
    std::vector<Image> images = {Picture(0, 0.1 * i)};
    if (i < 20) images.push_back(Picture(1, 0.1 * i));
    Inspect(images);
  }
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("right silent: no image since 11.9")));
  EXPECT_EQ(Report("right").health.level, HealthLevel::kFailed);
  EXPECT_THAT(Report("right").health.reason, HasSubstr("4.0 s before the end"));
  EXPECT_EQ(Report("left").health.level, HealthLevel::kHealthy);
}

TEST_F(CameraWatchTest, ACameraThatNeverDeliversHasFailed) {
  for (int i = 0; i < 30; ++i) Inspect({Picture(0, 0.1 * i)});
  EXPECT_THAT(messages_, ElementsAre(HasSubstr("right silent: no image in the first 2.0 s")));
  EXPECT_EQ(Report("right").health.reason, "no image arrived");
}

TEST_F(CameraWatchTest, GapsAreCountedAndWhatWasDroppedElsewhereIsTakenOver) {
  for (int i = 0; i < 30; ++i) Inspect({Picture(0, 0.1 * i + (i >= 15 ? 1.5 : 0.0))});
  watch_.AddDropped(0, "unreadable message", 2);
  const StreamReport report = Report("left");
  EXPECT_EQ(report.gaps, 1);
  EXPECT_NEAR(report.longest_gap, 1.6, 1e-6);
  EXPECT_EQ(report.received, 32);
  EXPECT_EQ(report.dropped.at("unreadable message"), 2);
  EXPECT_EQ(report.health.level, HealthLevel::kDegraded);
}

}  // namespace
}  // namespace mlvi

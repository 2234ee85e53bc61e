// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/image_set_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

using ::testing::ElementsAre;

Time At(double seconds) { return Time::FromSeconds(100.0 + seconds); }

// Sends images in the order of their arrival and notes when each set came out, and with which
// cameras.
class ImageSets : public ::testing::Test {
 protected:
  struct Arrival {
    int camera = 0;
    double stamp = 0.0;
  };
  struct Left {
    ImageSet set;
    double delay = 0.0;  // s, from its stamp to the newest instant known when it came out
  };

  void Send(int camera, double stamp, double delay = 0.0) {
    arrivals_.emplace(stamp + delay, Arrival{camera, stamp});
  }
  std::vector<Left> Run(int cameras, const ImageSetConfig& config = {}) {
    ImageSetBuilder builder(config, cameras);
    std::vector<Left> left;
    double now = 0.0;
    const auto take = [&](std::vector<ImageSet> sets) {
      for (ImageSet& set : sets) {
        const double delay = now - (set.stamp - At(0.0)).seconds();
        left.push_back({std::move(set), delay});
      }
    };
    for (const auto& [arrival, image] : arrivals_) {
      for (; now < arrival; now += 0.005) take(builder.Advance(At(now)));
      take(builder.Push({.stamp = At(image.stamp), .camera = image.camera}));
    }
    take(builder.Flush());
    late_ = builder.late();
    for (std::size_t i = 1; i < left.size(); ++i)
      EXPECT_GT(left[i].set.stamp, left[i - 1].set.stamp);
    return left;
  }
  static std::vector<int> Cameras(const ImageSet& set) {
    std::vector<int> cameras;
    for (const Image& image : set.images) cameras.push_back(image.camera);
    return cameras;
  }
  // The number of sets with each combination of cameras.
  static std::map<std::vector<int>, int> Count(const std::vector<Left>& left) {
    std::map<std::vector<int>, int> counts;
    for (const Left& entry : left) ++counts[Cameras(entry.set)];
    return counts;
  }

  std::multimap<double, Arrival> arrivals_;
  std::vector<std::int64_t> late_;
};

TEST_F(ImageSets, SynchronousCamerasFormOneSetPerInstant) {
  RandomStream random(1);
  for (int i = 0; i < 100; ++i) {
    for (int camera = 0; camera < 4; ++camera)
      Send(camera, 0.05 * i + 1e-3 * random.Uniform(), 0.02 * random.Uniform());
  }
  const std::vector<Left> left = Run(4);
  const auto counts = Count(left);
  EXPECT_EQ(counts, (std::map<std::vector<int>, int>{{{0, 1, 2, 3}, 100}}));
  for (const Left& entry : left) {
    EXPECT_LT(entry.delay, 0.03);
    for (const Image& image : entry.set.images) EXPECT_LE(image.stamp, entry.set.stamp);
  }
}

TEST_F(ImageSets, DoNotWaitForSlowerCamerasThatAreNotDue) {
  for (int i = 0; i < 100; ++i) {
    Send(0, 0.05 * i);
    if (i % 3 == 0) Send(1, 0.05 * i, 0.01);
  }
  const std::vector<Left> left = Run(2);
  const auto counts = Count(left);
  EXPECT_EQ(counts.at({0, 1}), 34);
  EXPECT_EQ(counts.at({0}), 66);
  for (const Left& entry : left) {
    if (entry.set.stamp > At(1.5)) {
      EXPECT_LT(entry.delay, 0.02) << entry.set.images.size() << " images";
    }
  }
}

TEST_F(ImageSets, ACameraThatDiesIsWaitedForBrieflyAndThenNoLonger) {
  for (int i = 0; i < 100; ++i) {
    Send(0, 0.05 * i);
    if (i < 40) Send(1, 0.05 * i);
  }
  const std::vector<Left> left = Run(2);
  ASSERT_EQ(left.size(), 100U);
  EXPECT_EQ(Count(left).at({0, 1}), 40);
  for (const Left& entry : left) {
    EXPECT_LT(entry.delay, 0.12);
    if (entry.set.stamp > At(3.2)) {
      EXPECT_LT(entry.delay, 0.01);
    }
  }
}

TEST_F(ImageSets, ACameraThatNeverComesOrComesBackIsNoTrouble) {
  for (int i = 0; i < 100; ++i) {
    Send(0, 0.05 * i);
    if (i < 20 || i >= 60) Send(1, 0.05 * i);
  }
  const auto counts = Count(Run(3));  // camera 2 never comes
  EXPECT_EQ(counts.at({0, 1}), 59);   // nobody waits for the first one after the silence
  EXPECT_EQ(counts.at({0}), 41);
}

TEST_F(ImageSets, LostImagesLeaveTheSetsOfTheOthersInPlace) {
  RandomStream random(1);
  std::vector<int> sent(3, 0);
  for (int i = 0; i < 300; ++i) {
    for (int camera = 0; camera < 3; ++camera) {
      if (random.Uniform() < 0.2) continue;
      Send(camera, 0.066 * i, 0.01 * camera);
      ++sent[static_cast<std::size_t>(camera)];
    }
  }
  std::vector<int> received(3, 0);
  for (const Left& entry : Run(3)) {
    EXPECT_LT(entry.delay, 0.12);
    for (const Image& image : entry.set.images) ++received[static_cast<std::size_t>(image.camera)];
  }
  EXPECT_EQ(received, sent);
}

// Whatever the phase: one set per period, no longer than the reach, each image with its own stamp.
TEST_F(ImageSets, CamerasThatRunFreelyFormOneSetPerPeriod) {
  for (const double phase : {0.004, 0.010, 0.03, 0.05, 0.07, 0.08, 0.097}) {
    arrivals_.clear();
    for (int i = 0; i < 50; ++i) {
      Send(0, 0.1 * i);
      Send(1, 0.1 * i + phase, 0.01);
    }
    const std::vector<Left> left = Run(2);
    // Until the period is known images have to be nearer.
    EXPECT_GE(Count(left).at({0, 1}), 48) << phase;
    EXPECT_LE(left.size(), 52U) << phase;
    for (const Left& entry : left) {
      EXPECT_LT(entry.delay, 0.12) << phase;
      if (entry.set.images.size() < 2) continue;
      const Duration apart = entry.set.images[1].stamp - entry.set.images[0].stamp;
      EXPECT_LE(std::abs(apart.seconds()), 0.075) << phase;
      EXPECT_EQ(entry.set.stamp, std::max(entry.set.images[0].stamp, entry.set.images[1].stamp));
    }
    EXPECT_THAT(late_, ElementsAre(0, 0)) << phase;
  }
}

// A phase that drifts through a whole period: partners change, but no image is lost and few are
// alone.
TEST_F(ImageSets, PhasesMayDrift) {
  RandomStream random(2);
  for (int i = 0; i < 400; ++i) {
    Send(0, 0.1 * i + 0.002 * random.Uniform(), 0.01 * random.Uniform());
    Send(1, 0.1002 * i + 0.002 * random.Uniform(), 0.02 * random.Uniform());
    if (i % 2 == 0) Send(2, 0.1 * i + 0.045, 0.02);
  }
  int images = 0;
  const std::vector<Left> left = Run(3);
  for (const Left& entry : left) images += static_cast<int>(entry.set.images.size());
  EXPECT_EQ(images, 400 + 400 + 200);
  EXPECT_THAT(late_, ElementsAre(0, 0, 0));
  EXPECT_LT(left.size(), 410U);
}

// A camera of half the rate and of another phase is awaited only when it is due.
TEST_F(ImageSets, ASlowCameraThatRunsFreelyJoinsEverySecondSet) {
  for (int i = 0; i < 100; ++i) {
    Send(0, 0.1 * i);
    if (i % 2 == 0) Send(1, 0.1 * i + 0.03, 0.01);
  }
  const std::vector<Left> left = Run(2);
  EXPECT_GE(Count(left).at({0, 1}), 49);
  EXPECT_LE(left.size(), 101U);
  for (const Left& entry : left) {
    if (entry.set.stamp > At(1.5)) {
      EXPECT_LT(entry.delay, 0.02) << entry.set.images.size() << " images";
    }
  }
}

// It comes again 2 ms later with a stamp of its own, between those of two cameras: sets stay in
// order (checked by Run), and the next ones as they were.
TEST_F(ImageSets, ADoubleImageIsASetOfItsOwn) {
  for (int i = 0; i < 60; ++i) {
    Send(0, 0.1 * i);
    if (i == 30) Send(0, 0.1 * i + 0.002);
    Send(1, 0.1 * i + 0.004);
    Send(2, 0.1 * i + 0.03);
  }
  const auto counts = Count(Run(3));
  EXPECT_GE(counts.at({0, 1, 2}), 58);
  EXPECT_THAT(late_, ElementsAre(0, 0, 0));
}

// Stamps that jump about must not make sets overlap or lose images.
TEST_F(ImageSets, StayInOrderWithIrregularStamps) {
  RandomStream random(3);
  std::vector<double> stamp(3, 0.0);
  int sent = 0;
  for (int i = 0; i < 600; ++i) {
    const int camera = i % 3;
    stamp[static_cast<std::size_t>(camera)] += 0.02 + 0.1 * random.Uniform();
    Send(camera, stamp[static_cast<std::size_t>(camera)], 0.015 * random.Uniform());
    ++sent;
  }
  int received = 0;
  Time last;
  for (const Left& entry : Run(3)) {  // stamps rise: checked there
    for (const Image& image : entry.set.images) {
      EXPECT_TRUE(!last.valid() || image.stamp > last);
      ++received;
    }
    last = entry.set.stamp;
  }
  int late = 0;
  for (const std::int64_t count : late_) late += static_cast<int>(count);
  EXPECT_EQ(received + late, sent);
  EXPECT_LT(late, sent / 20);
}

TEST_F(ImageSets, WithoutReachCamerasTriggeredInTurnFormSetsOfTheirOwn) {
  for (int i = 0; i < 50; ++i) {
    Send(0, 0.066 * i);
    Send(1, 0.066 * i + 0.03);
  }
  ImageSetConfig config;
  config.reach = 0.0;
  const auto counts = Count(Run(2, config));
  EXPECT_EQ(counts.at({0}), 50);
  EXPECT_EQ(counts.at({1}), 50);
}

TEST_F(ImageSets, AnImageThatComesAfterItsSetHasLeftIsCountedAsLate) {
  const std::map<int, double> delays = {{30, 0.15}, {31, 0.10}, {32, 0.05}};
  for (int i = 0; i < 40; ++i) {
    Send(0, 0.05 * i);
    Send(1, 0.05 * i + 1e-4, delays.contains(i) ? delays.at(i) - 0.02 : 0.0);
  }
  const auto counts = Count(Run(2));
  EXPECT_EQ(counts.at({0, 1}), 39);
  EXPECT_EQ(counts.at({0}), 1);
  EXPECT_THAT(late_, ElementsAre(0, 1));
}

TEST_F(ImageSets, WithoutToleranceStampsMustBeEqual) {
  ImageSetConfig config;
  config.tolerance = config.reach = 0.0;
  Send(0, 0.0);
  Send(1, 0.0);
  Send(0, 0.1);
  Send(1, 0.1001);
  const std::vector<Left> left = Run(2, config);
  ASSERT_EQ(left.size(), 3U);
  EXPECT_THAT(Cameras(left[0].set), ElementsAre(0, 1));
  EXPECT_THAT(Cameras(left[1].set), ElementsAre(0));
  EXPECT_THAT(Cameras(left[2].set), ElementsAre(1));
}

}  // namespace
}  // namespace mlvi

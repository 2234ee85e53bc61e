// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/image_schedule.h"

#include <gtest/gtest.h>

#include <vector>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

Time At(double seconds) { return Time::FromSeconds(100.0 + seconds); }

// Stamps that camera 0 keeps of `count` images at `rate` Hz with jitter of `sigma` s.
std::vector<double> KeptOf(double rate, double max_rate, int count, double sigma) {
  ImageSchedule schedule(max_rate, 0.005);
  RandomStream random(1);
  std::vector<double> kept;
  for (int i = 0; i < count; ++i) {
    const double t = i / rate + sigma * random.Normal();
    if (schedule.Keep(0, At(t))) kept.push_back(t);
  }
  return kept;
}

TEST(ImageSchedule, ThinsToAWholeFractionOfTheRate) {
  EXPECT_EQ(KeptOf(30.0, 15.0, 300, 0.0).size(), 150U);
  EXPECT_EQ(KeptOf(40.0, 15.0, 300, 0.0).size(), 100U);  // 13.3 Hz
  EXPECT_EQ(KeptOf(40.0, 20.0, 300, 1e-4).size(), 150U);
}

TEST(ImageSchedule, SlowCamerasKeepAllImagesInSpiteOfJitter) {
  EXPECT_EQ(KeptOf(15.0, 15.0, 300, 1e-3).size(), 300U);
  EXPECT_EQ(KeptOf(10.0, 15.0, 300, 0.0).size(), 300U);
  EXPECT_EQ(KeptOf(30.0, 0.0, 300, 0.0).size(), 300U);
}

TEST(ImageSchedule, SynchronousCamerasKeepTheSameInstantsAlsoAfterALoss) {
  ImageSchedule schedule(15.0, 0.005);
  RandomStream random(2);
  std::vector<int> per_instant(300, 0);
  for (std::size_t i = 0; i < per_instant.size(); ++i) {
    for (int camera = 0; camera < 4; ++camera) {
      if (random.Uniform() < 0.05) continue;  // lost on the way: never offered
      if (schedule.Keep(camera, At(static_cast<double>(i) / 30.0 + 1e-4 * random.Normal())))
        ++per_instant[i];
    }
  }
  int sets = 0, images = 0;
  for (const int count : per_instant) {
    sets += count > 0 ? 1 : 0;
    images += count;
  }
  EXPECT_LT(sets, 165);           // 150 and a few extra ones for cameras that had missed theirs
  EXPECT_GT(images, 3.2 * sets);  // 3.8 of four arrive
}

TEST(ImageSchedule, CamerasTriggeredInTurnAreThinnedEachOnItsOwn) {
  ImageSchedule schedule(15.0, 0.005);
  std::vector<int> kept(2, 0);
  for (int i = 0; i < 300; ++i) {
    kept[0] += schedule.Keep(0, At(i / 30.0)) ? 1 : 0;
    kept[1] += schedule.Keep(1, At(i / 30.0 + 0.016)) ? 1 : 0;
  }
  EXPECT_EQ(kept, std::vector<int>({150, 150}));
}

TEST(ImageSchedule, OneStampFromTheFutureDoesNotBlockACamera) {
  ImageSchedule schedule(15.0, 0.005);
  EXPECT_TRUE(schedule.Keep(0, At(1.0)));
  EXPECT_TRUE(schedule.Keep(0, At(1e6)));
  EXPECT_TRUE(schedule.Keep(0, At(1.1)));
  EXPECT_FALSE(schedule.Keep(0, At(1.12)));
  EXPECT_TRUE(schedule.Keep(0, At(1.2)));
}

}  // namespace
}  // namespace mlvi

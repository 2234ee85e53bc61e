// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/random.h"

#include <gtest/gtest.h>

#include <vector>

namespace mlvi {
namespace {

// Pinned: simulated recordings of one seed must be the same on every machine and with every
// version.
TEST(RandomStream, KnownValues) {
  RandomStream bare(0);  // the published first value of SplitMix64 with seed 0, 0xe220a8397b1dcdaf
  EXPECT_EQ(bare.NextBits(), 16294208416658607535ULL);
  RandomStream named(42, "imu");
  EXPECT_EQ(named.NextBits(), 436913403572857679ULL);
  EXPECT_EQ(named.Uniform(), 0x1.76581bbf186a4p-1);
  EXPECT_NEAR(named.Normal(), 0.29117336361320328, 1e-15);  // log and cos are the C library's
  EXPECT_EQ(named.Fork(7).NextBits(), 13505437478403089581ULL);
}

TEST(RandomStream, NamesSeedsAndForksAreIndependent) {
  const std::vector<RandomStream> streams = {RandomStream(1, "imu"), RandomStream(1, "lidar"),
                                             RandomStream(2, "imu"), RandomStream(1, "imu").Fork(0),
                                             RandomStream(1, "imu").Fork(1)};
  constexpr int kCount = 20'000;
  for (std::size_t a = 0; a < streams.size(); ++a) {
    for (std::size_t b = a + 1; b < streams.size(); ++b) {
      RandomStream x = streams[a], y = streams[b];
      double correlation = 0.0;
      for (int i = 0; i < kCount; ++i) correlation += x.Normal() * y.Normal() / kCount;
      EXPECT_LT(std::abs(correlation), 5.0 / std::sqrt(kCount)) << a << " " << b;
    }
  }
}

TEST(RandomStream, ForksLeaveTheirStreamAlone) {
  RandomStream a(5), b(5);
  RandomStream child = a.Fork(3);
  child.NextBits();
  EXPECT_EQ(a.NextBits(), b.NextBits());
}

// Moments and tails, each within five standard deviations of its estimate.
TEST(RandomStream, UniformStatistics) {
  RandomStream random(11);
  constexpr int kCount = 1'000'000;
  double sum = 0.0, squares = 0.0;
  std::vector<int> histogram(20, 0);
  for (int i = 0; i < kCount; ++i) {
    const double u = random.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    squares += u * u;
    ++histogram[static_cast<std::size_t>(u * 20.0)];
  }
  EXPECT_NEAR(sum / kCount, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / kCount));
  EXPECT_NEAR(squares / kCount, 1.0 / 3.0, 5.0 * std::sqrt(4.0 / 45.0 / kCount));
  double chi_square = 0.0;
  for (const int n : histogram) chi_square += std::pow(n - kCount / 20.0, 2) / (kCount / 20.0);
  EXPECT_LT(chi_square, 43.8);  // 99.9 % of 19 degrees of freedom
}

TEST(RandomStream, NormalStatistics) {
  RandomStream random(12);
  constexpr int kCount = 1'000'000;
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  int beyond_two = 0;
  for (int i = 0; i < kCount; ++i) {
    const double z = random.Normal();
    m1 += z / kCount;
    m2 += z * z / kCount;
    m3 += z * z * z / kCount;
    m4 += z * z * z * z / kCount;
    if (std::abs(z) > 2.0) ++beyond_two;
  }
  EXPECT_NEAR(m1, 0.0, 5.0 / std::sqrt(kCount));
  EXPECT_NEAR(m2, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(m3, 0.0, 5.0 * std::sqrt(15.0 / kCount));
  EXPECT_NEAR(m4, 3.0, 5.0 * std::sqrt(96.0 / kCount));
  EXPECT_NEAR(beyond_two, 0.0455003 * kCount, 5.0 * std::sqrt(0.0455 * kCount));
}

TEST(RandomStream, SuccessiveValuesAreUncorrelated) {
  RandomStream random(13);
  constexpr int kCount = 200'000;
  double correlation = 0.0, last = random.Normal();
  for (int i = 0; i < kCount; ++i) {
    const double next = random.Normal();
    correlation += last * next / kCount;
    last = next;
  }
  EXPECT_LT(std::abs(correlation), 5.0 / std::sqrt(kCount));
}

}  // namespace
}  // namespace mlvi

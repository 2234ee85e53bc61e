// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <set>
#include <thread>

namespace mlvi {
namespace {

double SumOf(std::size_t size, std::size_t grain) {
  return ParallelReduce(
      size, grain, 0.0,
      [](std::size_t begin, std::size_t end) {
        double sum = 0.0;
        for (std::size_t i = begin; i < end; ++i)
          sum += std::sin(1e3 * static_cast<double>(i)) / (1.0 + static_cast<double>(i));
        return sum;
      },
      [](double& total, const double& part) { total += part; });
}

TEST(Parallel, ReductionsHaveTheSameBitsAtAnyThreadCount) {
  for (const std::size_t size : {0UL, 1UL, 7UL, 1000UL, 100'003UL}) {
    for (const std::size_t grain : {1UL, 64UL, 5000UL}) {
      double one = 0.0, two = 0.0;
      {
        const ThreadLimit limit(1);
        one = SumOf(size, grain);
      }
      {
        const ThreadLimit limit(2);
        two = SumOf(size, grain);
      }
      EXPECT_EQ(one, two) << size << " by " << grain;
      EXPECT_EQ(SumOf(size, grain), one);
    }
  }
}

TEST(Parallel, ChunksAreCombinedInTheirOrder) {
  const auto order = ParallelReduce(
      10, 3, std::vector<std::size_t>{},
      [](std::size_t begin, std::size_t) { return std::vector<std::size_t>{begin}; },
      [](std::vector<std::size_t>& all, const std::vector<std::size_t>& part) {
        all.insert(all.end(), part.begin(), part.end());
      });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 3, 6, 9}));
}

TEST(Parallel, VisitsEveryIndexOnce) {
  for (const std::size_t size : {0UL, 1UL, 999UL}) {
    for (const std::size_t grain : {0UL, 1UL, 10UL, 10'000UL}) {
      std::vector<std::atomic<int>> visits(size);
      ParallelFor(size, grain, [&](std::size_t i) { ++visits[i]; });
      for (const auto& count : visits) ASSERT_EQ(count, 1);
    }
  }
}

TEST(Parallel, OneThreadMeansOneThread) {
  const ThreadLimit limit(1);
  std::vector<std::thread::id> threads(1000);
  ParallelFor(threads.size(), 1, [&](std::size_t i) { threads[i] = std::this_thread::get_id(); });
  EXPECT_EQ(std::set<std::thread::id>(threads.begin(), threads.end()).size(), 1U);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/background_tasks.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

TEST(BackgroundTasks, AreDoneWhenWaitedForAtAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    BackgroundTasks background;
    std::vector<int> results(50, 0);
    std::vector<BackgroundTasks::Task> tasks;
    for (std::size_t i = 0; i < results.size(); ++i) {
      tasks.push_back(background.Run([&results, i] { results[i] = static_cast<int>(i) + 1; }));
    }
    for (std::size_t i = 0; i < results.size(); ++i) {
      tasks[i].Wait();
      EXPECT_EQ(results[i], static_cast<int>(i) + 1);
    }
  }
}

TEST(BackgroundTasks, ADestroyedTaskHasBeenDone) {
  BackgroundTasks background;
  bool done = false;
  {
    const BackgroundTasks::Task task = background.Run([&] { done = true; });
  }
  EXPECT_TRUE(done);
}

TEST(BackgroundTasks, ExceptionsComeOutOfWait) {
  BackgroundTasks background;
  BackgroundTasks::Task task = background.Run([] { throw std::runtime_error("broken"); });
  EXPECT_THROW(task.Wait(), std::runtime_error);
}

TEST(BackgroundTasks, ExceptionsThatNobodyWaitsForEndNothing) {
  BackgroundTasks background;
  for (int i = 0; i < 20; ++i) background.Run([] { throw std::runtime_error("broken"); });
}

}  // namespace
}  // namespace mlvi

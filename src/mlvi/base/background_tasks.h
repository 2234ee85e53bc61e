// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <memory>
#include <utility>

namespace mlvi {

// Work that free threads may do while the caller goes on. It counts towards ThreadLimit; where no
// thread is free, the caller does it when it waits. The tasks have an arena of their own, so that a
// parallel loop of the caller never stops to do one of them.
class BackgroundTasks {
 public:
  // A task under way. Its destructor waits for it, and drops what it threw.
  class Task {
   public:
    Task(Task&&) = default;
    Task& operator=(Task&&) = delete;
    ~Task() {
      try {
        Wait();
      } catch (...) {  // whoever wants to know waits
      }
    }
    // Returns when the task is done; throws what it threw.
    void Wait() {
      if (group_) arena_->execute([this] { group_->wait(); });
    }

   private:
    friend class BackgroundTasks;
    explicit Task(tbb::task_arena& arena)
        : arena_(&arena), group_(std::make_unique<tbb::task_group>()) {}

    tbb::task_arena* arena_;
    std::unique_ptr<tbb::task_group> group_;
  };

  // Must outlive the tasks. `work` is copied; what it refers to must live until it has been waited
  // for.
  template <typename Work>
  Task Run(Work&& work) {
    Task task(arena_);
    arena_.execute([&] { task.group_->run(std::forward<Work>(work)); });
    return task;
  }

 private:
  tbb::task_arena arena_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace mlvi {

// Wall times of named stages, collected by the instance that runs them and reported in
// summary.json.
class StageTimes {
 public:
  struct Statistics {
    std::size_t count = 0;
    double mean_ms = 0.0, p50_ms = 0.0, p95_ms = 0.0, p99_ms = 0.0, max_ms = 0.0;
  };

  void Record(const std::string& stage, double milliseconds) {
    samples_[stage].push_back(static_cast<float>(milliseconds));
  }
  std::map<std::string, Statistics> Summarize() const;

  // Records the time from construction to destruction.
  class Scope {
   public:
    Scope(StageTimes& times, std::string stage)
        : times_(times), stage_(std::move(stage)), start_(std::chrono::steady_clock::now()) {}
    ~Scope() {
      const std::chrono::duration<double, std::milli> elapsed =
          std::chrono::steady_clock::now() - start_;
      times_.Record(stage_, elapsed.count());
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    StageTimes& times_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_;
  };

 private:
  std::map<std::string, std::vector<float>> samples_;
};

}  // namespace mlvi

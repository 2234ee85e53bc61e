// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace mlvi {

// Progress of long work: a bar with remaining time on a terminal, plain lines (one per ten percent)
// in a log.
class ProgressBar {
 public:
  // Writes to `stream`, which must outlive the bar; nullptr makes it silent.
  ProgressBar(std::string title, std::FILE* stream);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `fraction` of the work done, in [0, 1]; `note` is a short text shown behind it.
  void Update(double fraction, const std::string& note = "");
  void Finish();

 private:
  void Draw(double fraction, const std::string& note);

  std::string title_;
  std::FILE* stream_;
  bool terminal_ = false;
  bool finished_ = false;
  int last_step_ = -1;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_draw_;
};

}  // namespace mlvi

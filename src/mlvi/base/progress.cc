// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

namespace mlvi {
namespace {

constexpr int kBarWidth = 30;
constexpr double kRedrawSeconds = 0.1;

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ProgressBar::ProgressBar(std::string title, std::FILE* stream)
    : title_(std::move(title)),
      stream_(stream),
      terminal_(stream != nullptr && isatty(fileno(stream)) == 1),
      start_(std::chrono::steady_clock::now()),
      last_draw_(start_) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && !finished_ && last_step_ >= 0) fmt::print(stream_, "\n");
}

void ProgressBar::Update(double fraction, const std::string& note) {
  if (stream_ == nullptr || finished_) return;
  fraction = std::clamp(fraction, 0.0, 1.0);
  const int step = static_cast<int>(fraction * 10.0);
  if (terminal_ ? SecondsSince(last_draw_) >= kRedrawSeconds : step > last_step_) {
    Draw(fraction, note);
    last_step_ = step;
  }
}

void ProgressBar::Finish() {
  if (stream_ == nullptr || finished_) return;
  if (terminal_ || last_step_ < 10) Draw(1.0, "");
  if (terminal_) fmt::print(stream_, "\n");
  finished_ = true;
}

void ProgressBar::Draw(double fraction, const std::string& note) {
  last_draw_ = std::chrono::steady_clock::now();
  const double elapsed = SecondsSince(start_);
  const double remaining = fraction > 0.0 ? elapsed * (1.0 - fraction) / fraction : 0.0;
  if (terminal_) {
    const int filled = static_cast<int>(fraction * kBarWidth);
    fmt::print(stream_, "\r{} [{:#<{}}{:.<{}}] {:3.0f} %  {:.0f} s left  {}\033[K", title_, "",
               filled, "", kBarWidth - filled, 100.0 * fraction, remaining, note);
  } else {
    fmt::print(stream_, "{}: {:.0f} % after {:.1f} s, about {:.1f} s left {}\n", title_,
               100.0 * fraction, elapsed, remaining, note);
  }
  std::fflush(stream_);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sensors/image_schedule.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

// A camera of exactly the rate asked for, whose stamps jitter, must not lose every other image.
constexpr double kJitterShare = 0.1;
// Other cameras' images of an instant may arrive this many instants later.
constexpr std::size_t kRemembered = 8;

}  // namespace

ImageSchedule::ImageSchedule(double max_rate, double tolerance)
    : min_interval_(max_rate > 0.0 ? Duration::FromSeconds((1.0 - kJitterShare) / max_rate)
                                   : Duration()),
      tolerance_(Duration::FromSeconds(tolerance)) {
  MLVI_CHECK(max_rate >= 0.0 && tolerance >= 0.0, "rate {} Hz, tolerance {} s", max_rate,
             tolerance);
}

bool ImageSchedule::Keep(int camera, Time stamp) {
  Time& last = last_kept_[camera];
  const bool due = !last.valid() || stamp <= last || stamp - last >= min_interval_;
  if (NearChosen(stamp)) {
    last = stamp;
    return true;
  }
  if (!due) return false;
  last = stamp;
  chosen_.push_back(stamp);
  if (chosen_.size() > kRemembered) chosen_.pop_front();
  return true;
}

bool ImageSchedule::NearChosen(Time stamp) const {
  return std::any_of(chosen_.begin(), chosen_.end(), [&](Time chosen) {
    const Duration difference = stamp - chosen;
    return difference <= tolerance_ && difference >= -tolerance_;
  });
}

}  // namespace mlvi

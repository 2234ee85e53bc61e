// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/image_set_builder.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

// A camera that has not delivered for this long is not waited for. For this long after the first
// image all are, whatever their rates, which are not known yet.
constexpr Duration kSilence = Duration::FromMilliseconds(1000);

bool Holds(const ImageSet& set, int camera) {
  return std::any_of(set.images.begin(), set.images.end(),
                     [&](const Image& image) { return image.camera == camera; });
}

// The shortest of recent intervals: a lost image must not make the camera look slow.
Duration UpdatedPeriod(Duration period, Duration interval) {
  if (period == Duration()) return interval;
  return std::min(interval, period + period / 20);
}

}  // namespace

ImageSetBuilder::ImageSetBuilder(const ImageSetConfig& config, int cameras)
    : tolerance_(Duration::FromSeconds(config.tolerance)),
      max_wait_(Duration::FromSeconds(config.max_wait)),
      streams_(static_cast<std::size_t>(cameras)),
      late_(static_cast<std::size_t>(cameras), 0) {}

std::vector<ImageSet> ImageSetBuilder::Push(Image image) {
  MLVI_CHECK(image.camera >= 0 && static_cast<std::size_t>(image.camera) < streams_.size(),
             "camera {} of {}", image.camera, streams_.size());
  Stream& stream = streams_[static_cast<std::size_t>(image.camera)];
  MLVI_CHECK(!stream.newest.valid() || image.stamp > stream.newest, "camera {}: {} after {}",
             image.camera, ToString(image.stamp), ToString(stream.newest));
  if (stream.newest.valid())
    stream.period = UpdatedPeriod(stream.period, image.stamp - stream.newest);
  stream.newest = image.stamp;
  if (!first_.valid()) first_ = image.stamp;
  now_ = std::max(now_, image.stamp);
  if (left_.valid() && image.stamp <= left_ + tolerance_) {
    ++late_[static_cast<std::size_t>(image.camera)];
  } else {
    Pending& pending = SetOf(image);
    pending.set.stamp = std::max(pending.set.stamp, image.stamp);
    pending.set.images.push_back(std::move(image));
  }
  return Release();
}

std::vector<ImageSet> ImageSetBuilder::Advance(Time now) {
  now_ = std::max(now_, now);
  return pending_.empty() ? std::vector<ImageSet>() : Release();
}

std::vector<ImageSet> ImageSetBuilder::Flush() {
  if (!pending_.empty()) now_ = pending_.back().anchor + max_wait_ + Duration::FromNanoseconds(1);
  return Release();
}

// The set within tolerance that lacks this camera, or a new one.
ImageSetBuilder::Pending& ImageSetBuilder::SetOf(const Image& image) {
  for (Pending& pending : pending_) {
    const Duration difference = image.stamp - pending.anchor;
    if (difference <= tolerance_ && -difference <= tolerance_ && !Holds(pending.set, image.camera))
      return pending;
  }
  const auto behind =
      std::upper_bound(pending_.begin(), pending_.end(), image.stamp,
                       [](Time t, const Pending& pending) { return t < pending.anchor; });
  return *pending_.insert(behind, Pending{.anchor = image.stamp, .set = {}});
}

std::vector<ImageSet> ImageSetBuilder::Release() {
  std::vector<ImageSet> sets;
  while (!pending_.empty() &&
         (IsComplete(pending_.front()) || now_ - pending_.front().anchor > max_wait_)) {
    left_ = pending_.front().anchor;
    sets.push_back(std::move(pending_.front().set));
    pending_.pop_front();
    std::sort(sets.back().images.begin(), sets.back().images.end(),
              [](const Image& a, const Image& b) { return a.camera < b.camera; });
  }
  return sets;
}

bool ImageSetBuilder::IsComplete(const Pending& pending) const {
  for (int camera = 0; camera < static_cast<int>(streams_.size()); ++camera) {
    if (IsAwaited(camera, pending)) return false;
  }
  return true;
}

// Whether an image of this camera may still come for the set.
bool ImageSetBuilder::IsAwaited(int camera, const Pending& pending) const {
  if (Holds(pending.set, camera)) return false;
  const Stream& stream = streams_[static_cast<std::size_t>(camera)];
  const bool starting = pending.anchor - first_ < kSilence;
  if (!stream.newest.valid()) return starting;
  const Duration since = pending.anchor - stream.newest;
  if (since < -tolerance_ || since > kSilence) return false;  // it is past this instant, or silent
  if (starting) return true;
  return since + tolerance_ >= stream.period - stream.period / 4;
}

}  // namespace mlvi

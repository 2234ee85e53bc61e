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
      reach_(config.reach),
      streams_(static_cast<std::size_t>(cameras)),
      left_with_(static_cast<std::size_t>(cameras), 0),
      late_(static_cast<std::size_t>(cameras), 0) {}

std::vector<ImageSet> ImageSetBuilder::Push(Image image) {
  MLVI_CHECK(image.camera >= 0 && static_cast<std::size_t>(image.camera) < streams_.size(),
             "camera {} of {}", image.camera, streams_.size());
  Stream& stream = streams_[static_cast<std::size_t>(image.camera)];
  MLVI_CHECK(!stream.newest.valid() || image.stamp > stream.newest, "camera {}: {} after {}",
             image.camera, ToString(image.stamp), ToString(stream.newest));
  // An image that comes twice, with another stamp, tells nothing about the period.
  if (stream.newest.valid() && image.stamp - stream.newest > tolerance_)
    stream.period = UpdatedPeriod(stream.period, image.stamp - stream.newest);
  stream.newest = image.stamp;
  if (!first_.valid()) first_ = image.stamp;
  now_ = std::max(now_, image.stamp);
  if (IsLate(image)) {
    ++late_[static_cast<std::size_t>(image.camera)];
  } else {
    SetOf(image).Add(std::move(image));
  }
  return Release();
}

std::vector<ImageSet> ImageSetBuilder::Advance(Time now) {
  now_ = std::max(now_, now);
  return pending_.empty() ? std::vector<ImageSet>() : Release();
}

std::vector<ImageSet> ImageSetBuilder::Flush() {
  ended_ = true;
  return Release();
}

// Whether it comes after the set that it belongs to, or after a later one.
bool ImageSetBuilder::IsLate(const Image& image) const {
  if (!left_.valid()) return false;
  const bool lacked = left_with_[static_cast<std::size_t>(image.camera)] == 0;
  return image.stamp <= (lacked ? left_ + tolerance_ : left_);
}

// The set within reach that lacks this camera, or a new one.
ImageSetBuilder::Pending& ImageSetBuilder::SetOf(const Image& image) {
  const Duration reach = Reach();
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    Pending& pending = pending_[i];
    const Duration span =
        std::max(pending.set.stamp, image.stamp) - std::min(pending.first, image.stamp);
    const bool between = (i == 0 || image.stamp > pending_[i - 1].set.stamp) &&
                         (i + 1 == pending_.size() || image.stamp < pending_[i + 1].first);
    if (span <= reach && between && !Holds(pending.set, image.camera)) return pending;
  }
  return BeginSet(image);
}

// Images of the set before that are not earlier go with the new one.
ImageSetBuilder::Pending& ImageSetBuilder::BeginSet(const Image& image) {
  const auto behind =
      std::upper_bound(pending_.begin(), pending_.end(), image.stamp,
                       [](Time t, const Pending& pending) { return t < pending.first; });
  const auto place = static_cast<std::size_t>(behind - pending_.begin());
  Pending begun{.first = image.stamp, .set = {}}, before;
  if (place > 0) {
    for (Image& other : pending_[place - 1].set.images) {
      (other.stamp < image.stamp ? before : begun).Add(std::move(other));
    }
    pending_[place - 1] = std::move(before.set.images.empty() ? begun : before);
    if (pending_[place - 1].first == image.stamp) return pending_[place - 1];
  }
  return *pending_.insert(behind, std::move(begun));
}

void ImageSetBuilder::Pending::Add(Image image) {
  first = set.images.empty() ? image.stamp : std::min(first, image.stamp);
  set.stamp = std::max(set.stamp, image.stamp);
  set.images.push_back(std::move(image));
}

std::vector<ImageSet> ImageSetBuilder::Release() {
  std::vector<ImageSet> sets;
  while (!pending_.empty() && (ended_ || IsComplete(pending_.front()))) {
    sets.push_back(std::move(pending_.front().set));
    pending_.pop_front();
    left_ = sets.back().stamp;
    std::fill(left_with_.begin(), left_with_.end(), 0);
    for (const Image& image : sets.back().images) {
      left_with_[static_cast<std::size_t>(image.camera)] = 1;
    }
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
  const bool starting = pending.first - first_ < kSilence;
  if (!stream.newest.valid()) return starting && now_ - pending.first <= max_wait_;
  if (stream.newest >= pending.first) return false;  // it is past this set
  if (pending.first - stream.newest > kSilence) return false;
  const Time due = std::max(pending.first, stream.newest + stream.period);
  if (now_ - due > max_wait_) return false;
  return starting || due - ShortestPeriod() / 8 <= pending.first + Reach();
}

Duration ImageSetBuilder::ShortestPeriod() const {
  Duration shortest;
  for (const Stream& stream : streams_) {
    if (stream.period == Duration() || now_ - stream.newest > kSilence) continue;
    shortest = shortest == Duration() ? stream.period : std::min(shortest, stream.period);
  }
  return shortest;
}

Duration ImageSetBuilder::Reach() const {
  return std::max(tolerance_, Duration::FromSeconds(reach_ * ShortestPeriod().seconds()));
}

}  // namespace mlvi

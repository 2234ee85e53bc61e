// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/camera_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace mlvi {
namespace {

// So many in a row are no chance.
constexpr std::int64_t kReportAfter = 5;
// Pixels between those that are looked at: enough for a judgement of the whole picture.
constexpr std::size_t kStride = 13;

// FNV-1a over a share of the pixels.
std::uint64_t Fingerprint(const Image& image) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (std::size_t i = 0; i < image.pixels.size(); i += kStride)
    hash = (hash ^ image.pixels[i]) * 1099511628211ULL;
  return hash;
}

// The grey value that 95 % of the pixels stay below: a lamp or two do not make a dark picture
// bright.
int BrightPercentile(const Image& image) {
  std::array<std::size_t, 256> histogram{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += kStride, ++count)
    ++histogram[image.pixels[i]];
  std::size_t below = 0;
  for (std::size_t grey = 0; grey < histogram.size(); ++grey) {
    below += histogram[grey];
    if (20 * below >= 19 * count) return static_cast<int>(grey);
  }
  return 255;
}

}  // namespace

void CameraWatchConfig::Declare(ConfigDeclaration& d) {
  d.Field("gap_periods", gap_periods, "periods",
          "A longer distance of images of one camera is a gap", {1.5, 1e4});
  d.Field("silent_after", silent_after, "s",
          "A camera without images for this long is reported as silent", {0.1, 1e4});
  d.Field("dark_level", dark_level, "grey values",
          "A picture is dark when 95 % of it stay below this", {0.0, 255.0});
  d.Field("degraded_share", degraded_share, "",
          "A camera with a larger share of unusable images is degraded", {0.0, 1.0});
}

CameraWatch::CameraWatch(const CameraWatchConfig& config, const Rig& rig, const EventBus& events)
    : config_(config), events_(events) {
  for (const CameraSpec& camera : rig.cameras) {
    cameras_.emplace_back();
    cameras_.back().name = camera.name;
  }
}

ImageSet CameraWatch::Inspect(ImageSet set) {
  Advance(set.stamp);
  std::erase_if(set.images, [this](const Image& image) {
    Watched& camera = cameras_[static_cast<std::size_t>(image.camera)];
    ++camera.report.received;
    ObserveGap(image, camera);
    ObserveLight(image, camera);
    const bool frozen = IsFrozen(image, camera);
    ++(frozen ? camera.report.dropped["frozen: the same picture again"] : camera.report.used);
    return frozen;
  });
  return set;
}

bool CameraWatch::IsFrozen(const Image& image, Watched& camera) {
  const std::uint64_t fingerprint = Fingerprint(image);
  // Black is black: a dark picture may well repeat.
  const bool repeats =
      camera.report.received > 1 && fingerprint == camera.fingerprint && camera.dark_in_a_row == 0;
  camera.fingerprint = fingerprint;
  camera.frozen_in_a_row = repeats ? camera.frozen_in_a_row + 1 : 0;
  if (!repeats) return false;
  ++camera.frozen;
  if (camera.frozen_in_a_row == kReportAfter) {
    camera.was_frozen = true;
    Warn(camera, image.stamp,
         fmt::format("frozen: {} times the same picture in a row before {}; its images are not "
                     "used until they change. "
                     "Likely the camera or its driver hangs.",
                     kReportAfter, ToString(image.stamp)));
  }
  return true;
}

void CameraWatch::ObserveGap(const Image& image, Watched& camera) {
  const Duration interval = camera.newest.valid() ? image.stamp - camera.newest : Duration();
  const bool gap = camera.period > Duration() &&
                   interval.seconds() > config_.gap_periods * camera.period.seconds();
  if (gap) {
    camera.report.longest_gap = std::max(camera.report.longest_gap, interval.seconds());
    if (camera.report.gaps++ == 0) {
      Warn(camera, image.stamp,
           fmt::format("gap of {:.3f} s before {} (shortest period {:.4f} s); its tracks are "
                       "continued when it is short "
                       "enough, else begun anew. Further gaps are counted in the summary.",
                       interval.seconds(), ToString(image.stamp), camera.period.seconds()));
    }
  }
  if (camera.newest.valid()) {
    camera.period = camera.period > Duration() ? std::min(camera.period, interval) : interval;
  }
  camera.newest = image.stamp;
  camera.silent = false;
}

void CameraWatch::ObserveLight(const Image& image, Watched& camera) {
  const int bright = BrightPercentile(image);
  const bool dark = bright < config_.dark_level;
  camera.dark_in_a_row = dark ? camera.dark_in_a_row + 1 : 0;
  if (!dark) return;
  ++camera.dark;
  if (camera.dark_in_a_row == kReportAfter && !camera.was_dark) {
    camera.was_dark = true;
    Warn(
        camera, image.stamp,
        fmt::format(
            "dark: 95 % of the picture at {} are below grey value {}. Lens covered, no light, or "
            "exposure too "
            "short; it gives few features or none. Further dark images are counted in the summary.",
            ToString(image.stamp), bright));
  }
}

void CameraWatch::Advance(Time now) {
  if (!first_.valid()) first_ = now;
  now_ = std::max(now_, now);
  for (Watched& camera : cameras_) {
    const Time since = camera.newest.valid() ? camera.newest : first_;
    if (camera.silent || (now_ - since).seconds() <= config_.silent_after) continue;
    camera.silent = true;
    Warn(camera, now_,
         camera.newest.valid()
             ? fmt::format("silent: no image since {}; the other sensors go on without it.",
                           ToString(camera.newest))
             : fmt::format(
                   "silent: no image in the first {:.1f} s; the other sensors go on without it.",
                   config_.silent_after));
  }
}

void CameraWatch::AddDropped(int camera, const std::string& reason, std::int64_t count) {
  if (count == 0) return;
  StreamReport& report = cameras_[static_cast<std::size_t>(camera)].report;
  report.dropped[reason] += count;
  report.received += count;
}

void CameraWatch::Conclude() {
  for (Watched& camera : cameras_) camera.report.health = Judge(camera);
}

Health CameraWatch::Judge(const Watched& camera) const {
  const StreamReport& report = camera.report;
  if (report.used == 0) {
    if (report.received == 0) return {HealthLevel::kFailed, "no image arrived"};
    return {HealthLevel::kFailed, "no image could be used: " + DroppedText(report, "images")};
  }
  if (camera.silent) {
    return {HealthLevel::kFailed,
            fmt::format("no image after {}, {:.1f} s before the end", ToString(camera.newest),
                        (now_ - camera.newest).seconds())};
  }
  const auto received = static_cast<double>(report.received);
  const auto frozen = static_cast<double>(camera.frozen);
  if (camera.was_frozen || frozen > config_.degraded_share * received) {
    return {HealthLevel::kDegraded,
            fmt::format("frozen in {} of {} images", camera.frozen, report.received)};
  }
  if (SuffersFromDrops(report, config_.degraded_share)) {
    return {HealthLevel::kDegraded, DroppedText(report, "images")};
  }
  if (static_cast<double>(camera.dark) > config_.degraded_share * received) {
    return {HealthLevel::kDegraded,
            fmt::format("dark in {} of {} images", camera.dark, report.received)};
  }
  if (report.gaps > 0) {
    return {HealthLevel::kDegraded,
            fmt::format("{} gaps, the longest {:.3f} s", report.gaps, report.longest_gap)};
  }
  return {};
}

void CameraWatch::Warn(const Watched& camera, Time stamp, const std::string& message) const {
  events_.Raise(
      {.stamp = stamp, .severity = Severity::kWarning, .source = camera.name, .message = message});
}

std::map<std::string, StreamReport> CameraWatch::Reports() const {
  std::map<std::string, StreamReport> reports;
  for (const Watched& camera : cameras_) reports[camera.name] = camera.report;
  return reports;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/visual_odometry.h"

#include <fmt/format.h>

namespace mlvi {

void VisualConfig::Declare(ConfigDeclaration& d) {
  d.Section("images", sets);
  d.Section("cameras", watch);
  d.Section("vio", vio);
}

VisualOdometry::VisualOdometry(const VisualConfig& config, const Rig& rig, StageTimes& times,
                               const EventBus& events)
    : events_(events),
      sets_(config.sets, static_cast<int>(rig.cameras.size())),
      watch_(config.watch, rig, events),
      fit_(rig.CameraNames()),
      vio_(config.vio, rig, times),
      names_(rig.CameraNames()) {}

std::vector<ImageSet> VisualOdometry::Advance(Time now) {
  watch_.Advance(now);
  return Inspected(sets_.Advance(now));
}

std::vector<ImageSet> VisualOdometry::Inspected(std::vector<ImageSet> sets) {
  for (ImageSet& set : sets) set = watch_.Inspect(std::move(set));
  std::erase_if(sets, [](const ImageSet& set) { return set.images.empty(); });
  return sets;
}

VioResult VisualOdometry::Process(const ImageSet& set, std::span<const ImuSample> imu) {
  VioResult result = vio_.Process(set, imu);
  Observe(set, result);
  return result;
}

void VisualOdometry::TakeLidar(const OdometryEstimate& estimate, const PointCloud& points_body) {
  if (!report_.tracking) vio_.Start(estimate);
  vio_.AddDepthCloud(points_body, estimate.state.T_world_body, estimate.state.stamp);
}

void VisualOdometry::Observe(const ImageSet& set, const VioResult& result) {
  ++report_.sets;
  fit_.Add(result);
  const bool tracking = result.status == VioResult::Status::kTracking;
  if (tracking) {
    ++report_.sets_tracking;
    if (!report_.first_estimate.valid()) report_.first_estimate = set.stamp;
    report_.waiting_for.clear();
  } else if (!report_.first_estimate.valid()) {
    report_.waiting_for = result.reason;
  }
  if (report_.tracking && !tracking) {
    ++report_.failures;
    report_.last_failure = result.reason;
    events_.Raise({.stamp = set.stamp,
                   .severity = Severity::kWarning,
                   .source = "vio",
                   .message = fmt::format("visual odometry given up at {}: {}", ToString(set.stamp),
                                          result.reason)});
  }
  report_.tracking = tracking;
}

void VisualOdometry::AddDropped(const DropCounts& dropped) {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const auto of_camera = dropped.find(names_[i]);
    if (of_camera == dropped.end()) continue;
    for (const auto& [reason, count] : of_camera->second) {
      watch_.AddDropped(static_cast<int>(i), reason, count);
    }
  }
}

void VisualOdometry::Conclude() {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    watch_.AddDropped(static_cast<int>(i), "later than its set", sets_.late()[i]);
  }
  watch_.Conclude();
}

std::map<std::string, StreamReport> VisualOdometry::Streams() const {
  std::map<std::string, StreamReport> streams = watch_.Reports();
  for (std::size_t i = 0; i < names_.size(); ++i) {
    Health& health = streams.at(names_[i]).health;
    if (health.level == HealthLevel::kHealthy) health = fit_.Judge(static_cast<int>(i));
  }
  return streams;
}

}  // namespace mlvi

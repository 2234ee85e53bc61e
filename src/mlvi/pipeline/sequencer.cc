// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/sequencer.h"

#include <fmt/format.h>

#include <algorithm>

namespace mlvi {
namespace {

Time Stamp(const Measurement& measurement) {
  return std::visit([](const auto& m) { return m.stamp; }, measurement);
}

}  // namespace

std::string Sequencer::StreamName(const Measurement& measurement) const {
  if (std::holds_alternative<ImuSample>(measurement)) return "imu";
  if (std::holds_alternative<LidarSweep>(measurement)) return "lidar";
  const auto camera = static_cast<std::size_t>(std::get<Image>(measurement).camera);
  return camera < cameras_.size() ? cameras_[camera] : fmt::format("camera{}", camera);
}

std::vector<Measurement> Sequencer::Push(Measurement measurement) {
  std::vector<Measurement> ordered;
  if (!Admit(StreamName(measurement), Stamp(measurement))) return ordered;
  if (std::holds_alternative<ImuSample>(measurement)) {
    newest_imu_ = Stamp(measurement);
    ordered.push_back(std::move(measurement));
    ReleaseCovered(ordered);
  } else {
    const Time available = AvailableAt(measurement);
    const auto behind =
        std::upper_bound(waiting_.begin(), waiting_.end(), available,
                         [](Time t, const Measurement& other) { return t < AvailableAt(other); });
    waiting_.insert(behind, std::move(measurement));
    ReleaseCovered(ordered);
    GiveUpWaiting(available);
  }
  return ordered;
}

std::vector<Measurement> Sequencer::Flush() {
  std::vector<Measurement> ordered;
  ReleaseCovered(ordered);
  for (const Measurement& measurement : waiting_) {
    ++dropped_[StreamName(measurement)]["not covered by IMU at the end of the recording"];
  }
  waiting_.clear();
  return ordered;
}

bool Sequencer::Admit(const std::string& name, Time stamp) {
  Stream& stream = streams_[name];
  if (!stream.newest.valid()) {
    stream.newest = stamp;
    return true;
  }
  const double step = (stamp - stream.newest).seconds();
  if (step <= 0.0) {
    const bool report = step < 0.0 && !stream.behind;
    stream.behind = step < 0.0;
    Drop(name, step == 0.0 ? "duplicate stamp" : kStampGoesBack, stamp,
         !report ? ""
                 : fmt::format("time jumps back by {:.3f} s at {}; measurements are dropped until "
                               "it passes {} again. "
                               "Likely a clock reset: see the stamps with `mlvi info`, and cut the "
                               "recording there.",
                               -step, ToString(stamp), ToString(stream.newest)));
    return false;
  }
  const bool confirmed =
      stream.ahead.valid() && std::abs((stamp - stream.ahead).seconds()) < config_.max_future_jump;
  if (step > config_.max_future_jump && !confirmed) {
    stream.ahead = stamp;
    Drop(name, "stamp far in the future", stamp,
         fmt::format("stamp {} is {:.1f} s ahead of its predecessor; dropped unless the next one "
                     "confirms it.",
                     ToString(stamp), step));
    return false;
  }
  stream = Stream{.newest = stamp, .behind = false, .ahead = Time()};
  return true;
}

void Sequencer::Drop(const std::string& name, const std::string& reason, Time stamp,
                     const std::string& message) {
  ++dropped_[name][reason];
  if (!message.empty()) {
    events_.Raise(
        {.stamp = stamp, .severity = Severity::kWarning, .source = name, .message = message});
  }
}

void Sequencer::ReleaseCovered(std::vector<Measurement>& ordered) {
  while (!waiting_.empty() && newest_imu_.valid() && AvailableAt(waiting_.front()) <= newest_imu_) {
    ordered.push_back(std::move(waiting_.front()));
    waiting_.pop_front();
  }
}

void Sequencer::GiveUpWaiting(Time now) {
  while (!waiting_.empty()) {
    const Time available = AvailableAt(waiting_.front());
    if ((now - available).seconds() <= config_.max_imu_wait) return;
    const std::string name = StreamName(waiting_.front());
    Drop(name, "not covered by IMU", available,
         dropped_[name]["not covered by IMU"] > 0
             ? ""
             : fmt::format("measurement at {} dropped, the IMU did not reach it within {:.2f} s "
                           "({}). Likely an IMU "
                           "drop-out or clocks that differ: check the rig's time_offset.",
                           ToString(available), config_.max_imu_wait,
                           newest_imu_.valid() ? "its last sample: " + ToString(newest_imu_)
                                               : "it has delivered no usable sample so far"));
    waiting_.pop_front();
  }
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Order across streams. Sensors deliver late, twice or out of order; estimators want each
// measurement once, in time order, and a sweep only when the IMU reaches its last firing.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/pipeline/stream_report.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/state/health.h"

namespace mlvi {

// The reason under which measurements behind their stream's clock are counted as dropped.
inline constexpr char kStampGoesBack[] = "stamp goes back in time";

struct SequencerConfig {
  double max_imu_wait = 1.0;      // s
  double max_future_jump = 60.0;  // s
  void Declare(ConfigDeclaration& d) {
    d.Field("max_imu_wait", max_imu_wait, "s",
            "A sweep or image is given up when the IMU stays this far behind it: a dead IMU must "
            "not fill memory",
            {0.01, 60.0});
    d.Field("max_future_jump", max_future_jump, "s",
            "A stamp further ahead of its stream than this is a broken clock, not a gap",
            {1.0, 1e6});
  }
};

// Holds measurements back just long enough to emit them in order:
//  - IMU samples leave at once, in strictly ascending order; a sample that is not newer than its
//    predecessor is dropped;
//  - a sweep or an image leaves behind the first IMU sample at or after its last instant, in order
//    of that instant;
//  - stamps that jump back are dropped until the stream passes its former time, and reported once
//    per jump;
//  - a jump far ahead is dropped unless the stream stays there (a second measurement confirms it).
class Sequencer {
 public:
  // `events` must outlive the instance. `cameras`: names in messages and counts, by index.
  Sequencer(const SequencerConfig& config, const EventBus& events,
            std::vector<std::string> cameras = {})
      : config_(config), events_(events), cameras_(std::move(cameras)) {}

  // Takes one measurement in arrival order and returns those that are now in order.
  std::vector<Measurement> Push(Measurement measurement);
  // At the end of the recording: what is still held and covered by the IMU leaves, the rest is
  // counted as dropped.
  std::vector<Measurement> Flush();

  const DropCounts& dropped() const { return dropped_; }

 private:
  struct Stream {
    Time newest;
    bool behind = false;  // the last stamp jumped back
    Time ahead;           // a stamp too far in the future, waiting for confirmation
  };

  std::string StreamName(const Measurement& measurement) const;
  bool Admit(const std::string& name, Time stamp);
  void Drop(const std::string& name, const std::string& reason, Time stamp,
            const std::string& message);
  void ReleaseCovered(std::vector<Measurement>& ordered);
  void GiveUpWaiting(Time now);

  SequencerConfig config_;
  const EventBus& events_;
  std::vector<std::string> cameras_;
  std::map<std::string, Stream> streams_;
  Time newest_imu_;
  std::deque<Measurement> waiting_;  // sweeps and images in order of their last instant
  DropCounts dropped_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Watches the cameras one by one: dead, frozen and dark ones, gaps. It judges what arrives; what
// the estimator thinks of a camera is judged beside it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/pipeline/stream_report.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/health.h"

namespace mlvi {

struct CameraWatchConfig {
  double gap_periods = 2.5;
  double silent_after = 2.0;  // s
  double dark_level = 12.0;   // grey values
  double degraded_share = 0.2;
  void Declare(ConfigDeclaration& d);
};

class CameraWatch {
 public:
  // `events` must outlive the instance.
  CameraWatch(const CameraWatchConfig& config, const Rig& rig, const EventBus& events);

  // Takes note of a set, in order of time, and takes out images that repeat their predecessor bit
  // by bit: a camera or driver that hangs. Noise makes every picture of a living sensor different.
  ImageSet Inspect(ImageSet set);
  // Tells how far time has come: who is silent is reported while the recording runs.
  void Advance(Time now);
  // Takes over what was dropped elsewhere: reason -> count, for a camera by its index.
  void AddDropped(int camera, const std::string& reason, std::int64_t count);
  // Judges the whole run; call once at its end.
  void Conclude();

  // By the cameras' names.
  std::map<std::string, StreamReport> Reports() const;

 private:
  struct Watched {
    std::string name;
    StreamReport report;
    Time newest;
    Duration period;  // the shortest interval so far, zero before the second image
    std::uint64_t fingerprint = 0;
    std::int64_t dark = 0, frozen = 0, frozen_in_a_row = 0, dark_in_a_row = 0;
    bool silent = false, was_dark = false, was_frozen = false;  // the latter: for long enough
  };

  bool IsFrozen(const Image& image, Watched& camera);
  void ObserveGap(const Image& image, Watched& camera);
  void ObserveLight(const Image& image, Watched& camera);
  void Warn(const Watched& camera, Time stamp, const std::string& message) const;
  Health Judge(const Watched& camera) const;

  CameraWatchConfig config_;
  const EventBus& events_;
  std::vector<Watched> cameras_;  // by index
  Time first_, now_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/io/point_cloud2.h"
#include "mlvi/io/point_times.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// From the points of a message to a LidarSweep as sensors/measurements.h promises it: stamp at the
// first firing, offsets in nanoseconds from there, only returns within the rig's ranges. Keeps what
// the first sweeps tell about the encoding of times, counts of what it dropped or mended, and notes
// for the user (each finding once).
class SweepNormalizer {
 public:
  explicit SweepNormalizer(const LidarSpec& spec);

  // An Error when no point is left or when times make no sense; its message is a short reason
  // without numbers, under which the caller counts the sweep as dropped.
  Expected<LidarSweep> Normalize(RawSweep&& raw);

  // What to extract points with.
  const PointFilter& filter() const { return filter_; }
  const std::map<std::string, std::int64_t>& repaired() const { return repaired_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  bool ApplyMeasuredTimes(const RawSweep& raw, LidarSweep& sweep);
  void ApplyDerivedTimes(const RawSweep& raw, LidarSweep& sweep);
  void NoteTimes(const RawSweep& raw, const PointTimes& times);
  // `topic` of the finding, so that it is noted once; sweeps differ in numbers.
  void Note(const std::string& topic, std::string text);

  LidarSpec spec_;
  PointFilter filter_;
  Duration period_;
  PointTimer timer_;
  std::map<std::string, std::int64_t> repaired_;
  std::vector<std::string> notes_;
  std::set<std::string> noted_;
};

}  // namespace mlvi

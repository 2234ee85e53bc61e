// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "mlvi/base/error.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// Counts of one stream, by fate and reason.
struct StreamCounts {
  std::int64_t messages = 0;   // found in the recording
  std::int64_t delivered = 0;  // handed on as a measurement
  std::int64_t thinned = 0;    // left out on purpose: more images than are asked for
  std::map<std::string, std::int64_t> dropped;  // reason -> messages
  // Reason -> messages (or points, as the reason says) mended on the way.
  std::map<std::string, std::int64_t> repaired;
};

// A recording or a live driver, pulled one measurement at a time, in the order in which messages
// arrived. Streams may be out of order among and within themselves: the Sequencer of the pipeline
// restores order.
class MeasurementSource {
 public:
  virtual ~MeasurementSource() = default;

  // The next measurement; an empty optional at the end; an Error when the recording breaks off
  // (what was delivered before it stays valid, and further calls return the end).
  virtual Expected<std::optional<Measurement>> Next() = 0;

  // Share of the recording read so far, in [0, 1], for progress display.
  virtual double Progress() const = 0;
  // Message counts so far by stream (topic) name.
  virtual std::map<std::string, StreamCounts> Counts() const = 0;
  // Findings worth a user's attention, e.g. "imu: accelerations are in g, converted to m/s^2".
  virtual std::vector<std::string> Notes() const = 0;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Points out of PointCloud2 messages of any layout: offsets and datatypes are those of the
// message's own fields.
//
// To add a LiDAR whose driver names its fields differently, add the names to the tables at the top
// of point_cloud2.cc; units and conventions of times are found from the data (point_times.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/io/ros_messages.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// The points of a message that are returns, in the order of the message, before their times are
// understood.
struct RawSweep {
  Time header_stamp;
  std::vector<LidarPoint> points;  // offsets not set
  std::vector<double>
      times;               // raw, one per point, in the unit of the message; empty: no time field
  std::string time_field;  // its name
  // Of an organised cloud, per point: index of the firing column; else empty.
  std::vector<std::uint32_t> columns;
  std::uint32_t column_count = 0;
  bool has_rings = false;
  bool has_intensity = false;
  // Points that were left out, by reason ("points: NaN or infinite" and the like).
  std::map<std::string, std::int64_t> dropped;
};

struct PointFilter {
  double min_range = 0.0;  // m; nearer points are dropped
  double max_range = 1e9;  // m
  int rings = 0;  // lasers of the sensor, 0: unknown. Tells rows from columns of organised clouds
  bool read_times = true;
};

// Errors (kInput) name the fields that were found: no x, y, z of a float type; a field outside of
// the point; a big-endian message.
Expected<RawSweep> ExtractPoints(const PointCloud2View& cloud, const PointFilter& filter);

// Classifies one point and appends it; `raw` values of absent fields are zero. Used by all message
// types.
class PointSink {
 public:
  PointSink(const PointFilter& filter, RawSweep& sweep);
  // Returns false when the point was dropped (and counted).
  bool Add(const LidarPoint& point, double time);
  void FlushCounts();

 private:
  RawSweep& sweep_;
  bool with_times_;
  float min_squared_;
  float max_squared_;
  std::int64_t not_finite_ = 0, no_return_ = 0, too_near_ = 0, too_far_ = 0, bad_time_ = 0;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What is in a bag, found by reading all of it: for `mlvi info` and for finding out what to write
// into a rig file.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/io/imu_normalizer.h"
#include "mlvi/io/point_times.h"

namespace mlvi {

struct PointTopicInfo {
  std::string fields;  // with datatypes and offsets
  std::uint32_t height = 0, width = 0;
  std::uint32_t point_step = 0;
  std::size_t fewest_points = 0, most_points = 0;  // per message, all
  std::size_t returns = 0;                         // finite, non-zero points of the sample message
  std::string time_field;                          // empty: none
  double time_min = 0.0, time_max = 0.0;           // raw, of the sample message
  std::optional<PointTimes> times;  // what they mean, given the topic's rate; without offsets
};

struct ImuTopicInfo {
  double median_acceleration = 0.0;  // norm in the first second, in the unit of the bag
  AccelerationUnit unit = AccelerationUnit::kAuto;
  Eigen::Vector3d mean_acceleration = Eigen::Vector3d::Zero();  // over the first second
  Eigen::Vector3d mean_angular_velocity = Eigen::Vector3d::Zero();
};

struct TopicInfo {
  std::string topic;
  std::string type;
  std::int64_t messages = 0;
  bool header_stamps = false;  // times below are header stamps; else receipt times
  Time first, last;            // smallest and largest
  Duration largest_gap;        // between consecutive messages
  Time gap_begin;
  std::int64_t backwards = 0;  // messages with an earlier stamp than the one before
  Duration largest_delay;      // of receipt after the header's stamp
  std::optional<PointTopicInfo> points;
  std::optional<ImuTopicInfo> imu;
  std::string unreadable;  // why the first unreadable message was so; empty: none

  // Mean rate in Hz; 0 for fewer than two messages.
  double Rate() const;
};

struct BagInfo {
  std::string path;
  std::uint64_t file_size = 0;
  bool indexed = false;
  Time begin, end;                // receipt times of all messages
  std::vector<TopicInfo> topics;  // by name
  std::string damage;             // empty: the bag is sound
};

// Reads the whole bag. `progress` gets the share done, in [0, 1].
Expected<BagInfo> InspectBag(const std::string& path,
                             const std::function<void(double)>& progress = {});

}  // namespace mlvi

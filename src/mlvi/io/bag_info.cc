// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/bag_info.h"

#include <algorithm>
#include <map>

#include "mlvi/io/bag_reader.h"
#include "mlvi/io/livox.h"
#include "mlvi/io/point_cloud2.h"
#include "mlvi/io/ros_messages.h"

namespace mlvi {
namespace {

// Whether messages begin with a header: the first field of the definition says so.
bool BeginsWithHeader(std::string_view definition) {
  while (!definition.empty()) {
    const std::size_t end = std::min(definition.find('\n'), definition.size());
    std::string_view line = definition.substr(0, std::min(end, definition.find('#')));
    definition.remove_prefix(std::min(end + 1, definition.size()));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) continue;
    line.remove_prefix(begin);
    return line.starts_with("Header ") || line.starts_with("std_msgs/Header ");
  }
  return false;
}

// Collects what one topic shows.
class TopicInspector {
 public:
  explicit TopicInspector(const BagConnection& connection) {
    info_.topic = connection.topic;
    info_.type = connection.type;
    info_.header_stamps = BeginsWithHeader(connection.definition);
  }

  void Add(const BagMessage& message) {
    Time stamp = message.receipt;
    if (info_.header_stamps) {
      WireReader reader(message.data);
      stamp = ReadHeader(reader).stamp;
      info_.largest_delay = std::max(info_.largest_delay, message.receipt - stamp);
    }
    AddStamp(stamp);
    if (info_.type == kImuType) AddImu(message.data);
    if (info_.type == kPointCloud2Type) AddCloud(ParsePointCloud2(message.data));
    if (IsLivoxType(info_.type))
      AddCloud(ViewLivoxPoints(message.data, message.connection->definition));
  }

  TopicInfo Finish() {
    if (!imu_.empty()) FinishImu();
    if (info_.points && !sample_.times.empty()) FinishTimes();
    return info_;
  }

 private:
  void AddStamp(Time stamp) {
    ++info_.messages;
    if (previous_.valid()) {
      info_.backwards += stamp < previous_ ? 1 : 0;
      if (stamp - previous_ > info_.largest_gap) {
        info_.largest_gap = stamp - previous_;
        info_.gap_begin = previous_;
      }
    }
    info_.first = info_.first.valid() ? std::min(info_.first, stamp) : stamp;
    info_.last = std::max(info_.last, stamp);
    previous_ = stamp;
  }

  void AddImu(ByteSpan data) {
    if (!imu_.empty() && imu_.back().stamp - imu_.front().stamp > Duration::FromMilliseconds(1000))
      return;
    if (auto sample = ParseImu(data)) {
      imu_.push_back(*sample);
    } else if (info_.unreadable.empty()) {
      info_.unreadable = sample.error().message;
    }
  }

  void AddCloud(const Expected<PointCloud2View>& cloud) {
    if (!cloud) {
      if (info_.unreadable.empty()) info_.unreadable = cloud.error().message;
      return;
    }
    const std::size_t count = std::size_t{cloud->height} * cloud->width;
    if (!info_.points) {
      info_.points.emplace();
      info_.points->fewest_points = count;
    }
    PointTopicInfo& points = *info_.points;
    points.fewest_points = std::min(points.fewest_points, count);
    points.most_points = std::max(points.most_points, count);
    // The second message is the sample: the first one may be part of a turn.
    if (info_.messages > 2) return;
    points.fields = cloud->FieldList();
    points.height = cloud->height;
    points.width = cloud->width;
    points.point_step = cloud->point_step;
    if (auto sample = ExtractPoints(*cloud, {})) {
      sample_ = std::move(*sample);
    } else if (info_.unreadable.empty()) {
      info_.unreadable = sample.error().message;
    }
    points.returns = sample_.points.size();
  }

  void FinishImu() {
    ImuTopicInfo& imu = info_.imu.emplace();
    imu.median_acceleration = MedianAcceleration(imu_);
    imu.unit = DetectAccelerationUnit(imu.median_acceleration);
    for (const ImuSample& sample : imu_) {
      imu.mean_acceleration += sample.linear_acceleration / static_cast<double>(imu_.size());
      imu.mean_angular_velocity += sample.angular_velocity / static_cast<double>(imu_.size());
    }
  }

  void FinishTimes() {
    PointTopicInfo& points = *info_.points;
    points.time_field = sample_.time_field;
    const auto [min, max] = std::minmax_element(sample_.times.begin(), sample_.times.end());
    points.time_min = *min;
    points.time_max = *max;
    // Without a rate (one message): LiDARs turn ten times a second.
    const double rate = info_.Rate() > 0.0 ? info_.Rate() : 10.0;
    points.times = PointTimer(Duration::FromSeconds(1.0 / rate))
                       .Interpret(sample_.times, sample_.header_stamp);
    if (points.times) points.times->offsets.clear();
  }

  TopicInfo info_;
  Time previous_;
  std::vector<ImuSample> imu_;
  RawSweep sample_;
};

}  // namespace

double TopicInfo::Rate() const {
  const double span = messages < 2 ? 0.0 : (last - first).seconds();
  return span > 0.0 ? static_cast<double>(messages - 1) / span : 0.0;
}

Expected<BagInfo> InspectBag(const std::string& path, const std::function<void(double)>& progress) {
  auto reader = BagReader::Open(path);
  if (!reader) return tl::unexpected(reader.error());
  BagInfo info;
  info.path = path;
  info.file_size = (*reader)->file_size();
  info.indexed = (*reader)->indexed();
  std::map<std::string, TopicInspector> topics;
  for (std::int64_t count = 0;; ++count) {
    const auto message = (*reader)->Next();
    if (!message) {
      info.damage = message.error().message;
      continue;
    }
    if (!*message) break;
    const BagMessage& m = **message;
    topics.try_emplace(m.connection->topic, *m.connection).first->second.Add(m);
    info.begin = info.begin.valid() ? std::min(info.begin, m.receipt) : m.receipt;
    info.end = std::max(info.end, m.receipt);
    if (progress && count % 64 == 0) progress((*reader)->Progress());
  }
  // Topics that were announced, but have no message.
  for (const auto& [id, connection] : (*reader)->connections())
    topics.try_emplace(connection.topic, connection);
  for (auto& [topic, inspector] : topics) info.topics.push_back(inspector.Finish());
  return info;
}

}  // namespace mlvi

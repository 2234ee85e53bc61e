// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// ROS 1 messages as serialised bytes, for writing. (The generated headers of sensor_msgs in Debian
// 12 need C++17: they use std::allocator<void>::rebind.)
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/io/ros_messages.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// Appends values in ROS 1 serialisation.
class WireWriter {
 public:
  template <typename T>
  void Put(T value) {
    const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof(T));
  }
  void PutBlock(ByteSpan block) {
    Put(static_cast<std::uint32_t>(block.size()));
    bytes_.insert(bytes_.end(), block.begin(), block.end());
  }
  void PutText(std::string_view text) {
    PutBlock({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  // A std_msgs/Header.
  void PutHeader(Time stamp, std::string_view frame_id);

  std::vector<std::uint8_t> Take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

// A type as recorders store it: readers compare the MD5 sum of its definition.
struct RosType {
  std::string name;
  std::string md5;
  std::string definition;
};

struct RosMessage {
  RosType type;
  std::vector<std::uint8_t> bytes;
};

// A point cloud to be written; `data` holds height * width * point_step bytes.
struct PointCloud2Data {
  Time stamp;
  std::string frame_id;
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0;
  std::vector<std::uint8_t> data;
};

RosMessage ImuMessage(const ImuSample& sample);
RosMessage PointCloud2Message(const PointCloud2Data& cloud);
// "mono8" or "bgr8".
std::string_view EncodingOf(const Image& image);
RosMessage ImageMessage(const Image& image, const std::string& frame_id);
// `data`: an encoded image (image_encoder.h); `format`: e.g. "mono8; jpeg compressed ".
RosMessage CompressedImageMessage(Time stamp, const std::string& frame_id,
                                  const std::string& format, ByteSpan data);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The ROS 1 messages that mlvi reads, as views on serialised bytes: no copies, every length
// checked.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/io/wire_reader.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

inline constexpr char kImuType[] = "sensor_msgs/Imu";
inline constexpr char kPointCloud2Type[] = "sensor_msgs/PointCloud2";
inline constexpr char kLivoxType[] = "livox_ros_driver/CustomMsg";
inline constexpr char kImageType[] = "sensor_msgs/Image";
inline constexpr char kCompressedImageType[] = "sensor_msgs/CompressedImage";

struct MessageHeader {
  Time stamp;
  std::string_view frame_id;
};
// std_msgs/Header.
MessageHeader ReadHeader(WireReader& reader);

// sensor_msgs/Imu: angular velocity and acceleration as they stand, in the units of the recording.
Expected<ImuSample> ParseImu(ByteSpan message);

// The datatypes of sensor_msgs/PointField.
enum class PointDatatype : std::uint8_t {
  kInt8 = 1,
  kUint8 = 2,
  kInt16 = 3,
  kUint16 = 4,
  kInt32 = 5,
  kUint32 = 6,
  kFloat32 = 7,
  kFloat64 = 8
};
// Bytes of one value; 0 for an unknown datatype.
std::size_t SizeOf(PointDatatype datatype);
std::string_view NameOf(PointDatatype datatype);

struct PointField {
  std::string name;
  std::uint32_t offset = 0;  // bytes from the start of a point
  PointDatatype datatype = PointDatatype::kFloat32;
  std::uint32_t count = 1;
};

struct PointCloud2View {
  MessageHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  ByteSpan data;

  const PointField* Find(std::string_view name) const;
  // "x float32@0, y float32@4, ...", for messages.
  std::string FieldList() const;
};
// Errors when the message is cut short or when its sizes contradict each other.
Expected<PointCloud2View> ParsePointCloud2(ByteSpan message);

struct ImageView {
  MessageHeader header;
  std::uint32_t height = 0;  // 0 for compressed images
  std::uint32_t width = 0;
  std::uint32_t step = 0;
  std::string_view encoding;  // "mono8", ...; the format text of a compressed image
  ByteSpan data;
};
Expected<ImageView> ParseImage(ByteSpan message);
Expected<ImageView> ParseCompressedImage(ByteSpan message);

}  // namespace mlvi

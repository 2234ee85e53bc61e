// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_serialization.h"

namespace mlvi {
namespace {

// A definition ends with those of the types that it uses, each behind a line of 80 '='.
std::string Definition(std::string text,
                       std::initializer_list<std::pair<const char*, const char*>> nested) {
  for (const auto& [name, fields] : nested) {
    text += std::string(80, '=') + "\nMSG: " + name + "\n" + fields;
  }
  return text;
}

constexpr std::pair<const char*, const char*> kHeader = {
    "std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n"};
constexpr std::pair<const char*, const char*> kQuaternion = {
    "geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"};
constexpr std::pair<const char*, const char*> kVector3 = {"geometry_msgs/Vector3",
                                                          "float64 x\nfloat64 y\nfloat64 z\n"};
constexpr std::pair<const char*, const char*> kPointField = {
    "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 "
    "UINT32=6\nuint8 FLOAT32=7\n"
    "uint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n"};

RosType ImuRosType() {
  return {
      kImuType, "6a62c6daae103f4ff57a132d6f95cec2",
      Definition(
          "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
          "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
          "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
          {kHeader, kQuaternion, kVector3})};
}

RosType PointCloud2RosType() {
  return {kPointCloud2Type, "1158d486dd51d683ce2f1be655c3c181",
          Definition(
              "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n"
              "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
              {kHeader, kPointField})};
}

RosType ImageRosType() {
  return {kImageType, "060021388200f6f0f447d0fcd9c64743",
          Definition("Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 "
                     "is_bigendian\nuint32 step\n"
                     "uint8[] data\n",
                     {kHeader})};
}

RosType CompressedImageRosType() {
  return {kCompressedImageType, "8f7a12909da2c9d3332d540a0977563f",
          Definition("Header header\nstring format\nuint8[] data\n", {kHeader})};
}

void PutVector(const Eigen::Vector3d& v, WireWriter& writer) {
  for (int i = 0; i < 3; ++i) writer.Put(v[i]);
}

void PutZeros(int count, WireWriter& writer) {
  for (int i = 0; i < count; ++i) writer.Put(0.0);
}

}  // namespace

void WireWriter::PutHeader(Time stamp, std::string_view frame_id) {
  const std::int64_t ns = stamp.nanoseconds();
  MLVI_CHECK(ns >= 0 && ns / 1'000'000'000 <= 0xffffffffLL, "stamp {} ns does not fit a ROS time",
             ns);
  Put(std::uint32_t{0});  // sequence number
  Put(static_cast<std::uint32_t>(ns / 1'000'000'000));
  Put(static_cast<std::uint32_t>(ns % 1'000'000'000));
  PutText(frame_id);
}

RosMessage ImuMessage(const ImuSample& sample) {
  WireWriter writer;
  writer.PutHeader(sample.stamp, "imu");
  PutZeros(4, writer);
  writer.Put(-1.0);  // first element of the orientation's covariance: there is no orientation
  PutZeros(8, writer);
  PutVector(sample.angular_velocity, writer);
  PutZeros(9, writer);
  PutVector(sample.linear_acceleration, writer);
  PutZeros(9, writer);
  return {ImuRosType(), writer.Take()};
}

RosMessage PointCloud2Message(const PointCloud2Data& cloud) {
  WireWriter writer;
  writer.PutHeader(cloud.stamp, cloud.frame_id);
  writer.Put(cloud.height);
  writer.Put(cloud.width);
  writer.Put(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const PointField& field : cloud.fields) {
    writer.PutText(field.name);
    writer.Put(field.offset);
    writer.Put(static_cast<std::uint8_t>(field.datatype));
    writer.Put(field.count);
  }
  writer.Put(static_cast<std::uint8_t>(cloud.big_endian ? 1 : 0));
  writer.Put(cloud.point_step);
  writer.Put(cloud.point_step * cloud.width);
  writer.PutBlock(cloud.data);
  writer.Put(std::uint8_t{1});  // is_dense
  return {PointCloud2RosType(), writer.Take()};
}

std::string_view EncodingOf(const Image& image) { return image.channels == 3 ? "bgr8" : "mono8"; }

RosMessage CompressedImageMessage(Time stamp, const std::string& frame_id,
                                  const std::string& format, ByteSpan data) {
  WireWriter writer;
  writer.PutHeader(stamp, frame_id);
  writer.PutText(format);
  writer.PutBlock(data);
  return {CompressedImageRosType(), writer.Take()};
}

RosMessage ImageMessage(const Image& image, const std::string& frame_id) {
  WireWriter writer;
  writer.PutHeader(image.stamp, frame_id);
  writer.Put(static_cast<std::uint32_t>(image.height));
  writer.Put(static_cast<std::uint32_t>(image.width));
  writer.PutText(EncodingOf(image));
  writer.Put(std::uint8_t{0});
  writer.Put(static_cast<std::uint32_t>(image.width * image.channels));
  writer.PutBlock(image.pixels);
  return {ImageRosType(), writer.Take()};
}

}  // namespace mlvi

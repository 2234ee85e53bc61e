// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ros_messages.h"

#include <fmt/format.h>

#include <algorithm>

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

tl::unexpected<Error> CutShort(const char* type, std::size_t size) {
  return MakeError(kKind, "{} message of {} bytes is cut short", type, size);
}

Eigen::Vector3d ReadVector(WireReader& reader) {
  const double x = reader.Read<double>();
  const double y = reader.Read<double>();
  const double z = reader.Read<double>();
  return {x, y, z};
}

Expected<void> CheckSizes(const PointCloud2View& cloud) {
  const std::uint64_t row_bytes = std::uint64_t{cloud.width} * cloud.point_step;
  const std::uint64_t expected =
      cloud.height == 0 ? 0 : std::uint64_t{cloud.row_step} * (cloud.height - 1) + row_bytes;
  // Some drivers leave row_step at zero in clouds of one row; rows then follow one another.
  if ((cloud.row_step < row_bytes && cloud.height > 1) || expected > cloud.data.size()) {
    return MakeError(kKind,
                     "PointCloud2 of {} x {} points with point_step {} and row_step {} does not "
                     "fit its {} bytes of data",
                     cloud.height, cloud.width, cloud.point_step, cloud.row_step,
                     cloud.data.size());
  }
  return {};
}

}  // namespace

MessageHeader ReadHeader(WireReader& reader) {
  reader.Read<std::uint32_t>();  // sequence number
  MessageHeader header;
  header.stamp = reader.ReadTime();
  header.frame_id = reader.Text();
  return header;
}

Expected<ImuSample> ParseImu(ByteSpan message) {
  WireReader reader(message);
  ImuSample sample;
  sample.stamp = ReadHeader(reader).stamp;
  reader.Bytes((4 + 9) * sizeof(double));  // orientation and its covariance
  sample.angular_velocity = ReadVector(reader);
  reader.Bytes(9 * sizeof(double));
  sample.linear_acceleration = ReadVector(reader);
  if (!reader.ok()) return CutShort(kImuType, message.size());
  return sample;
}

std::size_t SizeOf(PointDatatype datatype) {
  switch (datatype) {
    case PointDatatype::kInt8:
    case PointDatatype::kUint8: return 1;
    case PointDatatype::kInt16:
    case PointDatatype::kUint16: return 2;
    case PointDatatype::kInt32:
    case PointDatatype::kUint32:
    case PointDatatype::kFloat32: return 4;
    case PointDatatype::kFloat64: return 8;
  }
  return 0;
}

std::string_view NameOf(PointDatatype datatype) {
  constexpr std::string_view kNames[] = {"?",     "int8",   "uint8",   "int16",  "uint16",
                                         "int32", "uint32", "float32", "float64"};
  const auto index = static_cast<std::size_t>(datatype);
  return index < std::size(kNames) ? kNames[index] : kNames[0];
}

const PointField* PointCloud2View::Find(std::string_view name) const {
  const auto field = std::find_if(fields.begin(), fields.end(),
                                  [&](const PointField& f) { return f.name == name; });
  return field == fields.end() ? nullptr : &*field;
}

std::string PointCloud2View::FieldList() const {
  std::string list;
  for (const PointField& field : fields) {
    list +=
        fmt::format("{}{} {}{}@{}", list.empty() ? "" : ", ", field.name, NameOf(field.datatype),
                    field.count == 1 ? "" : fmt::format("[{}]", field.count), field.offset);
  }
  return list;
}

Expected<PointCloud2View> ParsePointCloud2(ByteSpan message) {
  WireReader reader(message);
  PointCloud2View cloud;
  cloud.header = ReadHeader(reader);
  cloud.height = reader.Read<std::uint32_t>();
  cloud.width = reader.Read<std::uint32_t>();
  const auto field_count = reader.Read<std::uint32_t>();
  for (std::uint32_t i = 0; i < field_count && reader.ok(); ++i) {
    PointField field;
    field.name = reader.Text();
    field.offset = reader.Read<std::uint32_t>();
    field.datatype = static_cast<PointDatatype>(reader.Read<std::uint8_t>());
    field.count = reader.Read<std::uint32_t>();
    cloud.fields.push_back(std::move(field));
  }
  cloud.big_endian = reader.Read<std::uint8_t>() != 0;
  cloud.point_step = reader.Read<std::uint32_t>();
  cloud.row_step = reader.Read<std::uint32_t>();
  cloud.data = reader.Block();
  if (!reader.ok()) return CutShort(kPointCloud2Type, message.size());
  if (auto fits = CheckSizes(cloud); !fits) return tl::unexpected(fits.error());
  return cloud;
}

Expected<ImageView> ParseImage(ByteSpan message) {
  WireReader reader(message);
  ImageView image;
  image.header = ReadHeader(reader);
  image.height = reader.Read<std::uint32_t>();
  image.width = reader.Read<std::uint32_t>();
  image.encoding = reader.Text();
  reader.Read<std::uint8_t>();  // big-endian: means nothing for 8-bit images
  image.step = reader.Read<std::uint32_t>();
  image.data = reader.Block();
  if (!reader.ok()) return CutShort(kImageType, message.size());
  return image;
}

Expected<ImageView> ParseCompressedImage(ByteSpan message) {
  WireReader reader(message);
  ImageView image;
  image.header = ReadHeader(reader);
  image.encoding = reader.Text();
  image.data = reader.Block();
  if (!reader.ok()) return CutShort(kCompressedImageType, message.size());
  return image;
}

}  // namespace mlvi

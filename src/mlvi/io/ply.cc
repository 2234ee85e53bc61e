// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/ply.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <optional>
#include <sstream>

#include "mlvi/io/whole_file.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;
// Digits of the count that Close() fills in; leading blanks are allowed by every reader that splits
// on blanks.
constexpr int kCountWidth = 12;

struct Property {
  std::string name;
  std::size_t size = 0;
  bool is_double = false;
  bool is_float = false;
  std::size_t offset = 0;
};

struct Header {
  std::uint64_t vertices = 0;
  std::vector<Property> properties;
  std::size_t vertex_size = 0;
};

std::size_t SizeOfType(const std::string& type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
  if (type == "float" || type == "float32") return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

Expected<Header> ReadHeader(std::ifstream& file, const std::string& path) {
  Header header;
  std::string line, element;
  if (!std::getline(file, line) || !line.starts_with("ply"))
    return MakeError(kKind, "'{}' is no PLY file", path);
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string keyword, type, name;
    words >> keyword >> type >> name;
    if (keyword == "end_header") return header;
    if (keyword == "format" && type != "binary_little_endian") {
      return MakeError(kKind, "'{}' has PLY format '{}'; binary_little_endian is supported", path,
                       type);
    }
    if (keyword == "element") element = type;
    if (keyword == "element" && element == "vertex")
      header.vertices = std::strtoull(name.c_str(), nullptr, 10);
    if (keyword != "property" || element != "vertex") continue;
    const Property property{.name = name,
                            .size = SizeOfType(type),
                            .is_double = SizeOfType(type) == 8,
                            .is_float = type.starts_with("float") || type == "double",
                            .offset = header.vertex_size};
    if (property.size == 0)
      return MakeError(kKind, "'{}': vertex property type '{}' is not supported", path, type);
    header.vertex_size += property.size;
    header.properties.push_back(property);
  }
  return MakeError(kKind, "'{}': the PLY header does not end", path);
}

const Property* Find(const Header& header, const std::string& name) {
  const auto found = std::find_if(header.properties.begin(), header.properties.end(),
                                  [&](const Property& p) { return p.name == name && p.is_float; });
  return found == header.properties.end() ? nullptr : &*found;
}

float Value(const char* vertex, const Property* property) {
  if (property == nullptr) return 0.0F;
  if (property->is_double) {
    double value = 0.0;
    std::memcpy(&value, vertex + property->offset, sizeof(value));
    return static_cast<float>(value);
  }
  float value = 0.0F;
  std::memcpy(&value, vertex + property->offset, sizeof(value));
  return value;
}

}  // namespace

Expected<PlyWriter> PlyWriter::Create(const std::string& path, const std::string& comment,
                                      PlyFields fields) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\n";
  if (!comment.empty()) file << "comment " << comment << '\n';
  file << "element vertex ";
  const std::streamoff count_position = file.tellp();
  file << std::string(kCountWidth, ' ')
       << "\nproperty float x\nproperty float y\nproperty float z\n"
       << (fields == PlyFields::kPositionsAndIntensities ? "property float intensity\n" : "")
       << "end_header\n";
  if (!file) return CannotWrite(path);
  return PlyWriter(path, std::move(file), count_position, fields);
}

void PlyWriter::Write(const PlyPoint& point) {
  const float values[4] = {point.position.x(), point.position.y(), point.position.z(),
                           point.intensity};
  file_.write(reinterpret_cast<const char*>(values), fields_ == PlyFields::kPositions ? 12 : 16);
  ++count_;
}

Expected<void> PlyWriter::Close() {
  file_.seekp(count_position_);
  file_ << fmt::format("{:>{}}", count_, kCountWidth);
  file_.close();
  if (!file_) return CannotWrite(path_);
  return {};
}

Expected<void> WritePly(const std::vector<PlyPoint>& points, const std::string& path,
                        const std::string& comment) {
  auto writer = PlyWriter::Create(path, comment);
  if (!writer) return tl::unexpected(writer.error());
  for (const PlyPoint& point : points) writer->Write(point);
  return writer->Close();
}

Expected<std::vector<PlyPoint>> ReadPly(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return MakeError(kKind, "cannot open '{}': does the file exist?", path);
  const auto header = ReadHeader(file, path);
  if (!header) return tl::unexpected(header.error());
  const Property *x = Find(*header, "x"), *y = Find(*header, "y"), *z = Find(*header, "z");
  if (!x || !y || !z)
    return MakeError(kKind, "'{}': vertices have no float properties x, y, z", path);
  std::error_code ignored;
  const std::uint64_t available =
      std::filesystem::file_size(path, ignored) - static_cast<std::uint64_t>(file.tellg());
  if (header->vertices > available / header->vertex_size) {
    return MakeError(kKind, "'{}': {} vertices of {} bytes announced, but only {} bytes follow",
                     path, header->vertices, header->vertex_size, available);
  }
  const Property* intensity = Find(*header, "intensity");
  std::vector<PlyPoint> points(header->vertices);
  std::vector<char> vertex(header->vertex_size);
  for (PlyPoint& point : points) {
    file.read(vertex.data(), static_cast<std::streamsize>(vertex.size()));
    point.position = {Value(vertex.data(), x), Value(vertex.data(), y), Value(vertex.data(), z)};
    point.intensity = Value(vertex.data(), intensity);
  }
  if (!file) return MakeError(kKind, "'{}' cannot be read to its end", path);
  return points;
}

}  // namespace mlvi

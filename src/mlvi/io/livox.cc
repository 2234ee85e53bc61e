// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/livox.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

// One field of a message definition, e.g. "uint8[3] rsvd".
struct Field {
  std::string type;
  std::string name;
  bool is_array = false;
  std::optional<std::uint32_t> array_size;
};
using Fields = std::vector<Field>;
// The message itself under "", nested types under their names without package.
using Types = std::map<std::string, Fields, std::less<>>;

std::string_view NextWord(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return line = {};
  const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

std::string ShortName(std::string_view type) {
  return std::string(type.substr(type.rfind('/') + 1));
}

std::optional<Field> ParseField(std::string_view type, std::string_view name) {
  if (type.empty() || name.empty() || name.find('=') != std::string_view::npos) return std::nullopt;
  Field field;
  field.name = name;
  if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos) {
    field.is_array = true;
    std::uint32_t size = 0;
    const char* digits = type.data() + bracket + 1;
    if (std::from_chars(digits, type.data() + type.size(), size).ptr != digits)
      field.array_size = size;
    type = type.substr(0, bracket);
  }
  field.type = ShortName(type);
  return field;
}

Types ParseDefinition(std::string_view text) {
  Types types;
  std::string current;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, std::min(end, text.find('#')));
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view first = NextWord(line), second = NextWord(line), third = NextWord(line);
    if (first == "MSG:") {
      current = ShortName(second);
    } else if (third.starts_with('=')) {
      continue;  // a constant
    } else if (auto field = ParseField(first, second)) {
      types[current].push_back(std::move(*field));
    }
  }
  return types;
}

// Datatype 0 for types that a PointField cannot tell; `size` of all fixed-size ones.
struct Primitive {
  PointDatatype datatype;
  std::size_t size;
};
std::optional<Primitive> FindPrimitive(std::string_view type) {
  static constexpr std::pair<std::string_view, Primitive> kPrimitives[] = {
      {"int8", {PointDatatype::kInt8, 1}},       {"uint8", {PointDatatype::kUint8, 1}},
      {"byte", {PointDatatype::kInt8, 1}},       {"char", {PointDatatype::kUint8, 1}},
      {"bool", {PointDatatype::kUint8, 1}},      {"int16", {PointDatatype::kInt16, 2}},
      {"uint16", {PointDatatype::kUint16, 2}},   {"int32", {PointDatatype::kInt32, 4}},
      {"uint32", {PointDatatype::kUint32, 4}},   {"float32", {PointDatatype::kFloat32, 4}},
      {"float64", {PointDatatype::kFloat64, 8}}, {"int64", {PointDatatype{0}, 8}},
      {"uint64", {PointDatatype{0}, 8}},         {"time", {PointDatatype{0}, 8}},
      {"duration", {PointDatatype{0}, 8}}};
  for (const auto& [name, primitive] : kPrimitives) {
    if (name == type) return primitive;
  }
  return std::nullopt;
}

// The fields of a struct of fixed-size numbers, and its size in `step`; empty when it holds
// anything else.
std::vector<PointField> StructFields(const Fields& fields, std::size_t& step) {
  std::vector<PointField> points;
  step = 0;
  for (const Field& field : fields) {
    const auto primitive = FindPrimitive(field.type);
    if (!primitive || (field.is_array && (!field.array_size || *field.array_size > 4096)))
      return {};
    const std::uint32_t count = field.is_array ? *field.array_size : 1;
    if (primitive->datatype != PointDatatype{0} && count > 0) {
      points.push_back({field.name, static_cast<std::uint32_t>(step), primitive->datatype, count});
    }
    step += primitive->size * count;
  }
  return points;
}

// Moves past one field that holds numbers or texts.
bool Skip(const Field& field, WireReader& reader) {
  const std::uint32_t count = !field.is_array    ? 1
                              : field.array_size ? *field.array_size
                                                 : reader.Read<std::uint32_t>();
  if (const auto primitive = FindPrimitive(field.type)) {
    reader.Bytes(primitive->size * std::size_t{count});
    return reader.ok();
  }
  if (field.type != "string") return false;
  for (std::uint32_t i = 0; i < count && reader.ok(); ++i) reader.Text();
  return reader.ok();
}

}  // namespace

bool IsLivoxType(std::string_view type) { return type.ends_with("/CustomMsg"); }

Expected<PointCloud2View> ViewLivoxPoints(ByteSpan message, std::string_view definition) {
  const Types types = ParseDefinition(definition);
  const auto root = types.find("");
  PointCloud2View cloud;
  WireReader reader(message);
  for (const Field& field : root == types.end() ? Fields{} : root->second) {
    if (field.type == "Header") {
      cloud.header = ReadHeader(reader);
      continue;
    }
    const auto nested = types.find(field.type);
    if (nested == types.end() || !field.is_array || field.array_size) {
      if (!Skip(field, reader)) break;
      continue;
    }
    std::size_t step = 0;
    cloud.fields = StructFields(nested->second, step);
    cloud.height = 1;
    cloud.width = reader.Read<std::uint32_t>();
    cloud.point_step = static_cast<std::uint32_t>(step);
    cloud.data = reader.Bytes(step * std::size_t{cloud.width});
    if (!reader.ok() || cloud.fields.empty()) break;
    return cloud;
  }
  return MakeError(
      kKind,
      "CustomMsg of {} bytes: cut short, or its definition in the bag has no array of points with "
      "plain fields ({} types there)",
      message.size(), types.size());
}

}  // namespace mlvi

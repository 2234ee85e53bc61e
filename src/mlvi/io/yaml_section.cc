// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/yaml_section.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "mlvi/base/config.h"
#include "mlvi/base/time.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {
namespace {

Eigen::Matrix3d RowMajor3(const std::vector<double>& v, std::size_t stride) {
  Eigen::Matrix3d matrix;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      matrix(static_cast<int>(r), static_cast<int>(c)) = v[r * stride + c];
    }
  }
  return matrix;
}

// Flattens [1, 2, 3] and [[1, 2], [3]] alike: calibration tools write both.
bool Flatten(const YAML::Node& node, std::vector<double>& values) {
  if (node.IsSequence()) {
    return std::all_of(node.begin(), node.end(),
                       [&](const YAML::Node& item) { return Flatten(item, values); });
  }
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) return false;
  values.push_back(value);
  return true;
}

Expected<Pose3> PoseFromMatrix(const std::vector<double>& v, const std::string& field) {
  const auto rotation = RotationFromMatrix(RowMajor3(v, 4), field);
  if (!rotation) return tl::unexpected(rotation.error());
  if (v[12] != 0.0 || v[13] != 0.0 || v[14] != 0.0 || v[15] != 1.0) {
    return MakeError(ErrorKind::kConfiguration,
                     "{}: the last row of a 4x4 transform must be 0 0 0 1", field);
  }
  return Pose3(*rotation, Eigen::Vector3d(v[3], v[7], v[11]));
}

}  // namespace

Expected<YAML::Node> ParseYaml(const std::string& text, const std::string& origin) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    return MakeError(ErrorKind::kConfiguration, "{}:{}:{}: not valid YAML: {}", origin,
                     e.mark.line + 1, e.mark.column + 1, e.msg);
  }
}

void YamlErrors::Report(const YAML::Node& at, const std::string& message) {
  if (first_) return;
  const int line = at.IsDefined() ? at.Mark().line + 1 : 0;
  const std::string place = line > 0 ? fmt::format("{}:{}", origin_, line) : origin_;
  first_ = Error{kind_, fmt::format("{}: {}", place, message)};
}

YamlSection::YamlSection(YAML::Node node, std::string path, YamlErrors& errors)
    : node_(std::move(node)), path_(std::move(path)), errors_(errors) {
  if (!node_.IsMap()) {
    Report(fmt::format("{}: expected a map of keys", path_.empty() ? "document" : path_));
    node_ = YAML::Node(YAML::NodeType::Map);
  }
}

std::string YamlSection::PathOf(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

YAML::Node YamlSection::Node(std::string_view key) {
  known_.emplace_back(key);
  const YAML::Node& map = node_;  // the const operator[] does not insert
  return map[std::string(key)];
}

void YamlSection::ReportMissing(std::string_view key) {
  Report(fmt::format("missing field '{}'", PathOf(key)));
}

template <typename Value>
bool YamlSection::Convert(std::string_view key, Value& value, const char* expected) {
  const YAML::Node node = Node(key);
  if (!node.IsDefined()) return false;
  Value read{};
  if (!node.IsScalar() || !YAML::convert<Value>::decode(node, read)) {
    errors_.Report(node, fmt::format("{}: expected {}", PathOf(key), expected));
    return true;
  }
  value = read;
  return true;
}

bool YamlSection::Read(std::string_view key, double& value) {
  if (!Convert(key, value, "a number")) return false;
  if (!std::isfinite(value)) {
    errors_.Report(node_, fmt::format("{} = {}: must be finite", PathOf(key), value));
  }
  return true;
}
bool YamlSection::Read(std::string_view key, int& value) {
  return Convert(key, value, "an integer");
}
bool YamlSection::Read(std::string_view key, std::string& value) {
  return Convert(key, value, "a text");
}

bool YamlSection::Read(std::string_view key, Duration& seconds) {
  double value = seconds.seconds();
  if (!Read(key, value)) return false;
  if (std::abs(value) < 1e6) {
    seconds = Duration::FromSeconds(value);
  } else {
    Report(
        fmt::format("{} = {}: a time offset in seconds below 1e6 is expected", PathOf(key), value));
  }
  return true;
}

bool YamlSection::Read(std::string_view key, std::vector<double>& values, std::size_t size) {
  const YAML::Node node = Node(key);
  if (!node.IsDefined()) return false;
  std::vector<double> read;
  const bool numbers = node.IsSequence() && Flatten(node, read);
  const bool finite =
      std::all_of(read.begin(), read.end(), [](double v) { return std::isfinite(v); });
  if (!numbers || !finite || (size != 0 && read.size() != size)) {
    errors_.Report(node, fmt::format("{}: expected a list of {} finite numbers, found {}",
                                     PathOf(key), size == 0 ? "" : std::to_string(size),
                                     numbers ? std::to_string(read.size()) : "something else"));
    if (size != 0) read.assign(size, 0.0);
  }
  values = std::move(read);
  return true;
}

bool YamlSection::Read(std::string_view key, Eigen::Vector3d& value) {
  std::vector<double> values;
  if (!Read(key, values, 3)) return false;
  value = Eigen::Vector3d(values[0], values[1], values[2]);
  return true;
}

bool YamlSection::ReadChoice(std::string_view key, const std::vector<std::string>& names,
                             int& index) {
  std::string text;
  if (!Read(key, text)) return false;
  const auto name = std::find(names.begin(), names.end(), text);
  if (name == names.end()) {
    Report(fmt::format("{} = '{}': expected one of {}", PathOf(key), text, fmt::join(names, ", ")));
    return true;
  }
  index = static_cast<int>(name - names.begin());
  return true;
}

bool YamlSection::Read(std::string_view key, Pose3& value) {
  const YAML::Node node = Node(key);
  if (!node.IsDefined()) return false;
  const auto assign = [&](const Expected<Pose3>& pose) {
    if (pose) value = *pose;
    if (!pose) errors_.Report(node, pose.error().message);
    return true;
  };
  std::vector<double> matrix;
  if (node.IsSequence()) {
    Read(key, matrix, 16);
    return errors_.first() ? true : assign(PoseFromMatrix(matrix, PathOf(key)));
  }
  YamlSection section(node, PathOf(key), errors_);
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  if (!section.Read("t", t)) section.ReportMissing("t");
  std::vector<double> rotation, q;
  const bool has_matrix = section.Read("R", rotation, 9);
  const bool has_quaternion = section.Read("q_xyzw", q, 4);
  section.Finish();
  if (has_matrix == has_quaternion) {
    section.Report(fmt::format("{}: give either R (9 numbers, row by row) or q_xyzw", PathOf(key)));
  }
  if (errors_.first()) return true;
  if (has_matrix) {
    const auto R = RotationFromMatrix(RowMajor3(rotation, 3), PathOf(key) + ".R");
    return assign(R.map([&](const Eigen::Quaterniond& r) { return Pose3(r, t); }));
  }
  const Eigen::Quaterniond quaternion(q[3], q[0], q[1], q[2]);
  if (std::abs(quaternion.norm() - 1.0) > 1e-3) {
    section.Report(fmt::format("{}.q_xyzw: norm {} is not 1 (order is x, y, z, w)", PathOf(key),
                               quaternion.norm()));
    return true;
  }
  value = Pose3(quaternion, t);
  return true;
}

void YamlSection::Require(std::string_view key, double& value) {
  if (!Read(key, value)) ReportMissing(key);
}
void YamlSection::Require(std::string_view key, std::string& value) {
  if (!Read(key, value)) ReportMissing(key);
}
void YamlSection::Require(std::string_view key, Pose3& value) {
  if (!Read(key, value)) ReportMissing(key);
}

std::optional<YamlSection> YamlSection::Section(std::string_view key) {
  const YAML::Node node = Node(key);
  if (!node.IsDefined()) return std::nullopt;
  return YamlSection(node, PathOf(key), errors_);
}

std::vector<YamlSection> YamlSection::Sections(std::string_view key) {
  const YAML::Node node = Node(key);
  std::vector<YamlSection> sections;
  if (!node.IsDefined()) return sections;
  if (!node.IsSequence()) errors_.Report(node, fmt::format("{}: expected a list", PathOf(key)));
  for (std::size_t i = 0; node.IsSequence() && i < node.size(); ++i) {
    sections.emplace_back(node[i], fmt::format("{}[{}]", PathOf(key), i), errors_);
  }
  return sections;
}

void YamlSection::Finish() {
  std::vector<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
      const std::string nearest = NearestName(key, known_);
      errors_.Report(
          entry.first,
          fmt::format("unknown key '{}'{}", PathOf(key),
                      nearest.empty() ? fmt::format("; known are {}", fmt::join(known_, ", "))
                                      : fmt::format("; did you mean '{}'?", PathOf(nearest))));
    }
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      errors_.Report(entry.first, fmt::format("key '{}' is given twice", PathOf(key)));
    }
    seen.push_back(key);
  }
}

}  // namespace mlvi

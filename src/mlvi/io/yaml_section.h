// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Strict reading of YAML maps: every key is either read or an error, missing keys are named, and
// messages carry file, line and the dotted path of the value. The first error of a document wins.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// Parses the document; a syntax error becomes an Error with line and column. `origin` names it in
// messages.
Expected<YAML::Node> ParseYaml(const std::string& text, const std::string& origin);

// Where the errors of one document go.
class YamlErrors {
 public:
  YamlErrors(std::string origin, ErrorKind kind) : origin_(std::move(origin)), kind_(kind) {}

  void Report(const YAML::Node& at, const std::string& message);
  const std::optional<Error>& first() const { return first_; }
  const std::string& origin() const { return origin_; }

 private:
  std::string origin_;
  ErrorKind kind_;
  std::optional<Error> first_;
};

// One map of the document. Read its keys, then call Finish(), which reports keys that nobody asked
// for.
class YamlSection {
 public:
  // `errors` must outlive the section. A node that is no map is reported.
  YamlSection(YAML::Node node, std::string path, YamlErrors& errors);

  void Require(std::string_view key, double& value);
  void Require(std::string_view key, std::string& value);
  void Require(std::string_view key, Pose3& value);
  // Leave `value` alone when the key is absent; return whether it was there.
  bool Read(std::string_view key, double& value);
  bool Read(std::string_view key, int& value);
  bool Read(std::string_view key, std::string& value);
  bool Read(std::string_view key, Duration& seconds);
  bool Read(std::string_view key, Pose3& value);
  // A list of exactly `size` numbers (0: any number of them).
  bool Read(std::string_view key, std::vector<double>& values, std::size_t size);
  bool Read(std::string_view key, Eigen::Vector3d& value);
  // The index of the text in `names`.
  template <typename Enum>
  bool Read(std::string_view key, Enum& value, const std::vector<std::string>& names) {
    int index = static_cast<int>(value);
    const bool found = ReadChoice(key, names, index);
    value = static_cast<Enum>(index);
    return found;
  }
  // Nested maps, and lists of maps.
  std::optional<YamlSection> Section(std::string_view key);
  std::vector<YamlSection> Sections(std::string_view key);
  // The node itself, marked as read; undefined when absent.
  YAML::Node Node(std::string_view key);

  void Finish();
  // Reports an error at this map.
  void Report(const std::string& message) { errors_.Report(node_, message); }
  void ReportMissing(std::string_view key);
  std::string PathOf(std::string_view key) const;

 private:
  bool ReadChoice(std::string_view key, const std::vector<std::string>& names, int& index);
  template <typename Value>
  bool Convert(std::string_view key, Value& value, const char* expected);

  YAML::Node node_;
  std::string path_;
  YamlErrors& errors_;
  std::vector<std::string> known_;
};

}  // namespace mlvi

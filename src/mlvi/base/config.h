// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Configuration, declared once: a plain struct whose Declare() names each field with unit, reason
// and valid range. Reading a file, --set, the documentation page and the dump beside the results
// all derive from that declaration.
//
//   struct DeskewConfig {
//     double max_gap = 0.1;
//     void Declare(ConfigDeclaration& d) {
//       d.Field("max_gap", max_gap, "s", "Longest IMU gap that is bridged by interpolation", {0.0, 10.0});
//     }
//   };
#pragma once

#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

// Closed interval of valid values.
struct ConfigRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

// An enum seen as its index in a list of names; `Bind` makes one from any enum with values 0, 1,
// ...
struct ConfigEnumReference {
  int* value = nullptr;
  std::vector<std::string> names;
};

struct ConfigField {
  std::string key;   // dotted path, e.g. "lio.map.voxel_size"
  std::string unit;  // SI unit, "" when dimensionless
  std::string reason;
  std::variant<bool*, int*, double*, std::string*, ConfigEnumReference> value;
  ConfigRange range;
};

// "`low` must not exceed `high`", both keys of numeric fields.
struct ConfigOrder {
  std::string low, high;
  std::string consequence;  // of its violation
};

// Collects the fields of a configuration by visiting its Declare functions. Holds pointers into the
// visited struct: do not let it outlive that.
class ConfigDeclaration {
 public:
  // A declaration of all of `config`.
  template <typename Config>
  static ConfigDeclaration Of(Config& config) {
    ConfigDeclaration declaration;
    config.Declare(declaration);
    return declaration;
  }

  void Field(std::string_view name, bool& value, std::string_view reason);
  void Field(std::string_view name, std::string& value, std::string_view reason);
  void Field(std::string_view name, int& value, std::string_view unit, std::string_view reason,
             ConfigRange range = {});
  void Field(std::string_view name, double& value, std::string_view unit, std::string_view reason,
             ConfigRange range = {});
  // An enum with underlying type int and values 0, 1, ... named in that order.
  template <typename Enum>
  requires std::is_enum_v<Enum>
  void Field(std::string_view name, Enum& value, std::initializer_list<std::string> names,
             std::string_view reason) {
    static_assert(std::is_same_v<std::underlying_type_t<Enum>, int>);
    Add(name, "", reason, ConfigEnumReference{reinterpret_cast<int*>(&value), names}, {});
  }
  template <typename Config>
  void Section(std::string_view name, Config& config) {
    const std::string outer = prefix_;
    prefix_ += std::string(name) + ".";
    config.Declare(*this);
    prefix_ = outer;
  }

  // The field `low` must not exceed the field `high`: names of numeric fields declared before,
  // relative to this section. `consequence` completes "otherwise ...".
  void AtMost(std::string_view low, std::string_view high, std::string_view consequence);

  const std::vector<ConfigField>& fields() const { return fields_; }

  // Sets one field from text. Errors name the field, the value and the violated constraint; an
  // unknown key comes with the nearest valid one.
  Expected<void> Set(std::string_view key, std::string_view text);
  // "key=value".
  Expected<void> SetAssignment(std::string_view assignment);
  // Whether the values agree with one another, once all are set. Errors (kConfiguration) name both
  // fields, their values and the remedy.
  Expected<void> Check() const;
  // All fields as a nested YAML document, each with unit and reason as a comment.
  std::string ToYaml() const;
  // The documentation page: a Markdown table of key, default, unit, range and reason, and the rules
  // between fields.
  std::string ToMarkdown() const;

 private:
  void Add(std::string_view name, std::string_view unit, std::string_view reason,
           decltype(ConfigField::value) value, ConfigRange range);

  const ConfigField* Find(std::string_view key) const;

  std::string prefix_;
  std::vector<ConfigField> fields_;
  std::vector<ConfigOrder> orders_;
};

// The candidate with the smallest edit distance to `word`, or "" when that is beyond a third of the
// longer one's length.
std::string NearestName(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace mlvi

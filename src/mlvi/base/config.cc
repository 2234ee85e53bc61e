// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/base/config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>

#include "mlvi/base/suggestion.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

template <typename... Lambdas>
struct Overloaded : Lambdas... {
  using Lambdas::operator()...;
};
template <typename... Lambdas>
Overloaded(Lambdas...) -> Overloaded<Lambdas...>;

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
    }
  }
  return row.back();
}

template <typename Number>
bool ParseNumber(std::string_view text, Number& number) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  return code == std::errc() && end == text.data() + text.size();
}

Expected<void> CheckRange(const ConfigField& field, double value) {
  if (std::isfinite(value) && value >= field.range.min && value <= field.range.max) return {};
  return MakeError(kKind, "{} = {}: must be finite and in [{}, {}] {}", field.key, value,
                   field.range.min, field.range.max, field.unit);
}

template <typename Number>
Expected<void> SetNumber(const ConfigField& field, std::string_view text, Number& target) {
  Number number{};
  if (!ParseNumber(text, number)) {
    return MakeError(kKind, "{} = {}: expected {}", field.key, text,
                     std::is_integral_v<Number> ? "an integer" : "a number");
  }
  auto valid = CheckRange(field, static_cast<double>(number));
  if (valid) target = number;
  return valid;
}

// As a double-quoted YAML scalar.
std::string Quoted(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + "\"";
}

std::string ValueText(const ConfigField& field) {
  return std::visit(Overloaded{[](const bool* v) { return std::string(*v ? "true" : "false"); },
                               [](const int* v) { return fmt::format("{}", *v); },
                               [](const double* v) { return fmt::format("{}", *v); },
                               [](const std::string* v) { return Quoted(*v); },
                               [](const ConfigEnumReference& v) {
                                 return v.names.at(static_cast<std::size_t>(*v.value));
                               }},
                    field.value);
}

// Of a field of kind int or double.
std::optional<double> NumberOf(const ConfigField& field) {
  if (const auto* number = std::get_if<double*>(&field.value)) return **number;
  if (const auto* number = std::get_if<int*>(&field.value)) return **number;
  return std::nullopt;
}

std::string RangeText(const ConfigField& field) {
  if (const auto* names = std::get_if<ConfigEnumReference>(&field.value)) {
    return fmt::format("{}", fmt::join(names->names, " / "));
  }
  const bool has_min = std::isfinite(field.range.min), has_max = std::isfinite(field.range.max);
  if (has_min && has_max) return fmt::format("{} .. {}", field.range.min, field.range.max);
  if (has_min) return fmt::format(">= {}", field.range.min);
  if (has_max) return fmt::format("<= {}", field.range.max);
  return "";
}

std::vector<std::string> Split(std::string_view key) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    parts.emplace_back(key.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// Whether `part` is the last names of the dotted `key`.
bool IsEndOf(std::string_view part, std::string_view key) {
  return key.size() > part.size() && key.ends_with(part) &&
         key[key.size() - part.size() - 1] == '.';
}

}  // namespace

std::string NearestName(std::string_view word, const std::vector<std::string>& candidates) {
  std::string nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const std::string& candidate : candidates) {
    const std::size_t distance = EditDistance(word, candidate);
    const std::size_t most = (std::max(word.size(), candidate.size()) + 2) / 3;
    if (distance <= most && distance < least) {
      nearest = candidate;
      least = distance;
    }
  }
  return nearest;
}

void ConfigDeclaration::Add(std::string_view name, std::string_view unit, std::string_view reason,
                            decltype(ConfigField::value) value, ConfigRange range) {
  fields_.push_back({.key = prefix_ + std::string(name),
                     .unit = std::string(unit),
                     .reason = std::string(reason),
                     .value = std::move(value),
                     .range = range});
}

void ConfigDeclaration::Field(std::string_view name, bool& value, std::string_view reason) {
  Add(name, "", reason, &value, {});
}
void ConfigDeclaration::Field(std::string_view name, std::string& value, std::string_view reason) {
  Add(name, "", reason, &value, {});
}
void ConfigDeclaration::Field(std::string_view name, int& value, std::string_view unit,
                              std::string_view reason, ConfigRange range) {
  Add(name, unit, reason, &value, range);
}
void ConfigDeclaration::Field(std::string_view name, double& value, std::string_view unit,
                              std::string_view reason, ConfigRange range) {
  Add(name, unit, reason, &value, range);
}

void ConfigDeclaration::AtMost(std::string_view low, std::string_view high,
                               std::string_view consequence) {
  ConfigOrder order{prefix_ + std::string(low), prefix_ + std::string(high),
                    std::string(consequence)};
  for (const std::string& key : {order.low, order.high}) {
    const ConfigField* field = Find(key);
    MLVI_CHECK(field && NumberOf(*field), "'{}' is not declared as a number", key);
  }
  orders_.push_back(std::move(order));
}

const ConfigField* ConfigDeclaration::Find(std::string_view key) const {
  const auto field = std::find_if(fields_.begin(), fields_.end(),
                                  [&](const ConfigField& f) { return f.key == key; });
  return field == fields_.end() ? nullptr : &*field;
}

Expected<void> ConfigDeclaration::Check() const {
  for (const ConfigOrder& order : orders_) {
    const ConfigField &low = *Find(order.low), &high = *Find(order.high);
    if (*NumberOf(low) <= *NumberOf(high)) continue;
    return MakeError(kKind, "{} = {} exceeds {} = {}: {}. Lower {} or raise {}.", low.key,
                     ValueText(low), high.key, ValueText(high), order.consequence, low.key,
                     high.key);
  }
  return {};
}

Expected<void> ConfigDeclaration::Set(std::string_view key, std::string_view text) {
  const ConfigField* field = Find(key);
  if (!field) {
    std::vector<std::string> keys;
    for (const ConfigField& f : fields_) keys.push_back(f.key);
    const auto whole =
        std::ranges::find_if(keys, [&](const std::string& k) { return IsEndOf(key, k); });
    if (whole != keys.end())
      return MakeError(kKind, "unknown configuration key '{}'; did you mean '{}'?", key, *whole);
    return MakeError(kKind, "unknown configuration key '{}'{}", key, DidYouMean(key, keys));
  }
  return std::visit(
      Overloaded{[&](bool* value) -> Expected<void> {
                   if (text != "true" && text != "false") {
                     return MakeError(kKind, "{} = {}: expected true or false", key, text);
                   }
                   *value = text == "true";
                   return {};
                 },
                 [&](int* value) { return SetNumber(*field, text, *value); },
                 [&](double* value) { return SetNumber(*field, text, *value); },
                 [&](std::string* value) -> Expected<void> {
                   *value = text;
                   return {};
                 },
                 [&](const ConfigEnumReference& value) -> Expected<void> {
                   const auto name = std::find(value.names.begin(), value.names.end(), text);
                   if (name == value.names.end()) {
                     return MakeError(kKind, "{} = {}: expected one of {}", key, text,
                                      fmt::join(value.names, ", "));
                   }
                   *value.value = static_cast<int>(name - value.names.begin());
                   return {};
                 }},
      field->value);
}

Expected<void> ConfigDeclaration::SetAssignment(std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    return MakeError(kKind, "'{}': expected key=value", assignment);
  }
  return Set(assignment.substr(0, equals), assignment.substr(equals + 1));
}

std::string ConfigDeclaration::ToYaml() const {
  std::string yaml;
  std::vector<std::string> open;
  for (const ConfigField& field : fields_) {
    std::vector<std::string> parts = Split(field.key);
    const std::string name = parts.back();
    parts.pop_back();
    std::size_t common = 0;
    while (common < open.size() && common < parts.size() && open[common] == parts[common]) ++common;
    for (std::size_t i = common; i < parts.size(); ++i) {
      yaml += fmt::format("{:{}}{}:\n", "", 2 * i, parts[i]);
    }
    open = parts;
    const std::string unit = field.unit.empty() ? "" : " [" + field.unit + "]";
    yaml += fmt::format("{:{}}{}: {}  #{} {}\n", "", 2 * parts.size(), name, ValueText(field), unit,
                        field.reason);
  }
  return yaml;
}

std::string ConfigDeclaration::ToMarkdown() const {
  std::string page = "| key | default | unit | valid | why |\n|---|---|---|---|---|\n";
  for (const ConfigField& field : fields_) {
    page += fmt::format("| `{}` | {} | {} | {} | {} |\n", field.key, ValueText(field), field.unit,
                        RangeText(field), field.reason);
  }
  if (!orders_.empty()) page += "\n";
  for (const ConfigOrder& order : orders_) {
    page += fmt::format("- `{}` must not exceed `{}`: otherwise {}.\n", order.low, order.high,
                        order.consequence);
  }
  return page;
}

}  // namespace mlvi

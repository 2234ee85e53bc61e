// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// summary.json against its description in docs/outputs.md.
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace mlvi::test {

// The way to a value: keys of objects, "[]" for elements of lists. In a documented path <...>
// stands for any key.
using KeyPath = std::vector<std::string>;

// "streams.<name>.dropped.<reason>", "bags[]"
inline KeyPath ParsePath(const std::string& text) {
  KeyPath path(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '.') {
      path.emplace_back();
    } else if (text.compare(i, 2, "[]") == 0) {
      path.emplace_back("[]");
      ++i;
    } else {
      path.back() += text[i];
    }
  }
  return path;
}

// The first column of the table under "## summary.json".
inline std::vector<KeyPath> DocumentedPaths() {
  std::ifstream file(std::string(MLVI_SOURCE_DIR) + "/docs/outputs.md");
  std::vector<KeyPath> paths;
  bool within = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) within = line == "## summary.json";
    if (within && line.starts_with("| `"))
      paths.push_back(ParsePath(line.substr(3, line.find('`', 3) - 3)));
  }
  return paths;
}

inline void AppendLeaves(const nlohmann::json& value, const KeyPath& path,
                         std::vector<KeyPath>& leaves) {
  const auto below = [&](const std::string& key, const nlohmann::json& child) {
    KeyPath longer = path;
    longer.push_back(key);
    AppendLeaves(child, longer, leaves);
  };
  if (value.is_object()) {
    for (const auto& [key, child] : value.items()) below(key, child);
  } else if (value.is_array()) {
    for (const auto& child : value) below("[]", child);
  } else {
    leaves.push_back(path);
  }
}

// A null stands for all that would be below it.
inline bool Describes(const KeyPath& documented, const KeyPath& written, bool prefix) {
  if (prefix ? written.size() > documented.size() : written.size() != documented.size())
    return false;
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (!documented[i].starts_with('<') && documented[i] != written[i]) return false;
  }
  return true;
}

inline std::string ToText(const KeyPath& path) {
  std::string text;
  for (const std::string& key : path) text += (text.empty() ? "" : ".") + key;
  return text;
}

// What the document does not know.
inline std::vector<std::string> UndocumentedKeys(const nlohmann::json& summary) {
  std::vector<KeyPath> leaves;
  AppendLeaves(summary, {}, leaves);
  std::vector<std::string> unknown;
  for (const KeyPath& leaf : leaves) {
    bool known = false;
    for (const KeyPath& documented : DocumentedPaths())
      known = known || Describes(documented, leaf, true);
    if (!known) unknown.push_back(ToText(leaf));
  }
  return unknown;
}

// What the document promises under `root` (empty: anywhere) but for `except`, and is not written.
// Counts by reason need not be there.
inline std::vector<std::string> UnwrittenKeys(const nlohmann::json& summary,
                                              const std::string& root,
                                              const std::vector<std::string>& except = {}) {
  std::vector<KeyPath> leaves;
  AppendLeaves(summary, {}, leaves);
  std::vector<std::string> unwritten;
  for (const KeyPath& documented : DocumentedPaths()) {
    const std::string text = ToText(documented);
    bool expected = text.starts_with(root) && !documented.back().starts_with('<');
    for (const std::string& prefix : except) expected = expected && !text.starts_with(prefix);
    bool written = false;
    for (const KeyPath& leaf : leaves) written = written || Describes(documented, leaf, false);
    if (expected && !written) unwritten.push_back(text);
  }
  return unwritten;
}

}  // namespace mlvi::test

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/config_file.h"

#include <set>

#include "mlvi/io/whole_file.h"
#include "mlvi/io/yaml_section.h"

namespace mlvi {
namespace {

// Sets all scalars below `node`; `given` collects the keys.
void Apply(const YAML::Node& node, const std::string& key, ConfigDeclaration& declaration,
           std::set<std::string>& given, YamlErrors& errors) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      Apply(entry.second, key.empty() ? name : key + "." + name, declaration, given, errors);
    }
    return;
  }
  if (!node.IsScalar())
    return errors.Report(node, fmt::format("{}: expected a value or a map of keys", key));
  if (!given.insert(key).second) return errors.Report(node, fmt::format("{} is given twice", key));
  if (auto set = declaration.Set(key, node.Scalar()); !set)
    errors.Report(node, set.error().message);
}

}  // namespace

Expected<void> ApplyConfigText(const std::string& yaml, const std::string& origin,
                               ConfigDeclaration& declaration) {
  const auto document = ParseYaml(yaml, origin);
  if (!document) return tl::unexpected(document.error());
  if (document->IsNull()) return {};
  YamlErrors errors(origin, ErrorKind::kConfiguration);
  std::set<std::string> given;
  if (document->IsMap()) {
    Apply(*document, "", declaration, given, errors);
  } else {
    errors.Report(*document, "expected a map of keys");
  }
  if (errors.first()) return tl::unexpected(*errors.first());
  return {};
}

Expected<void> ApplyConfigFile(const std::string& path, ConfigDeclaration& declaration) {
  const auto text = ReadWholeFile(path, ErrorKind::kConfiguration);
  if (!text) return tl::unexpected(text.error());
  return ApplyConfigText(*text, path, declaration);
}

}  // namespace mlvi

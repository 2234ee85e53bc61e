// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/base/config.h"
#include "mlvi/base/error.h"

namespace mlvi {

// Sets the fields of a configuration from a YAML file; nested maps and dotted keys mean the same
// (`lio: {map: {voxel_size: 0.5}}`, `lio.map.voxel_size: 0.5`). Errors (kConfiguration) name file
// and line: unknown keys with the nearest valid one, impossible values, keys given twice. An empty
// file changes nothing.
Expected<void> ApplyConfigFile(const std::string& path, ConfigDeclaration& declaration);
Expected<void> ApplyConfigText(const std::string& yaml, const std::string& origin,
                               ConfigDeclaration& declaration);

}  // namespace mlvi

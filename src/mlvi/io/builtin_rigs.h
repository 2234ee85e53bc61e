// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace mlvi::internal {

struct BuiltinRig {
  std::string_view name;
  std::string_view yaml;
};

// The files of config/rigs, sorted by name. Defined in a source that CMake writes.
std::span<const BuiltinRig> BuiltinRigs();

}  // namespace mlvi::internal

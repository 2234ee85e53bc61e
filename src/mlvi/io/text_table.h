// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

// One line of a table of numbers: its words (between blanks or commas), and where it stands.
struct TableLine {
  int number = 0;  // from 1
  std::vector<std::string> words;
};

// Lines of a text without comments ('#') and empty ones.
std::vector<TableLine> SplitTable(std::string_view text);

// Words [first, first + count) as finite numbers; an Error (kInput) names file and line.
Expected<std::vector<double>> Numbers(const TableLine& line, std::size_t first, std::size_t count,
                                      const std::string& origin);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/text_table.h"

#include <cmath>
#include <cstdlib>

namespace mlvi {

std::vector<TableLine> SplitTable(std::string_view text) {
  constexpr std::string_view kSeparators = " \t\r,;";
  std::vector<TableLine> lines;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, std::min(end, text.find('#')));
    text.remove_prefix(std::min(end + 1, text.size()));
    TableLine result;
    result.number = number;
    while (true) {
      const std::size_t begin = line.find_first_not_of(kSeparators);
      if (begin == std::string_view::npos) break;
      const std::size_t stop = std::min(line.find_first_of(kSeparators, begin), line.size());
      result.words.emplace_back(line.substr(begin, stop - begin));
      line.remove_prefix(stop);
    }
    if (!result.words.empty()) lines.push_back(std::move(result));
  }
  return lines;
}

Expected<std::vector<double>> Numbers(const TableLine& line, std::size_t first, std::size_t count,
                                      const std::string& origin) {
  if (line.words.size() < first + count) {
    return MakeError(ErrorKind::kInput, "{}:{}: {} columns, expected at least {}", origin,
                     line.number, line.words.size(), first + count);
  }
  std::vector<double> numbers;
  for (std::size_t i = first; i < first + count; ++i) {
    char* end = nullptr;
    const double value = std::strtod(line.words[i].c_str(), &end);
    if (*end != '\0' || !std::isfinite(value)) {
      return MakeError(ErrorKind::kInput, "{}:{}: '{}' in column {} is no finite number", origin,
                       line.number, line.words[i], i + 1);
    }
    numbers.push_back(value);
  }
  return numbers;
}

}  // namespace mlvi

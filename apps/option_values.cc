// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "option_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace {

std::optional<double> FiniteNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

CLI::Validator NumberWhere(const std::string& range, const std::function<bool(double)>& allowed) {
  const auto complaint = [range, allowed](const std::string& text) -> std::string {
    const std::optional<double> number = FiniteNumber(text);
    if (number && allowed(*number)) return {};
    return fmt::format("{} is no finite number in {}", text, range);
  };
  return CLI::Validator(complaint, "in " + range);
}

}  // namespace

CLI::Validator NumberIn(double least, double most) {
  return NumberWhere(fmt::format("[{:g}, {:g}]", least, most),
                     [=](double x) { return x >= least && x <= most; });
}

CLI::Validator NumberAbove(double least, double most) {
  return NumberWhere(fmt::format("({:g}, {:g}]", least, most),
                     [=](double x) { return x > least && x <= most; });
}

mlvi::Expected<std::vector<double>> ParseNumbers(const std::string& option, const std::string& text,
                                                 std::size_t least, std::size_t most,
                                                 const std::string& form) {
  std::vector<double> numbers;
  bool good = true;
  for (std::size_t begin = 0; good && begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::optional<double> number =
        FiniteNumber(std::string_view(text).substr(begin, end - begin));
    good = number.has_value();
    numbers.push_back(number.value_or(0.0));
    begin = end + 1;
  }
  if (good && numbers.size() >= least && numbers.size() <= most) return numbers;
  return mlvi::MakeError(mlvi::ErrorKind::kConfiguration, "{} {}: expected {}", option, text, form);
}

void AddThreadsOption(CLI::App& command, int& threads) {
  constexpr int kMost = 1024;
  command
      .add_option("--threads", threads,
                  "Number of threads (0: all cores); results do not depend on it")
      ->check(CLI::Range(0, kMost));
}

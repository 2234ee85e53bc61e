// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What options of all subcommands take: finite numbers in a range, lists of numbers, one of a few
// names, threads.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

#include "mlvi/base/error.h"

// A finite number in [least, most]; CLI11's own checks let NaN through.
CLI::Validator NumberIn(double least, double most);
// The same without `least` itself.
CLI::Validator NumberAbove(double least, double most);

// Reads "NUMBER,NUMBER,...", `least` to `most` finite ones. Errors (kConfiguration) quote the
// option, its text and `form`, what it should look like.
mlvi::Expected<std::vector<double>> ParseNumbers(const std::string& option, const std::string& text,
                                                 std::size_t least, std::size_t most,
                                                 const std::string& form);

// `--threads`, the same everywhere.
void AddThreadsOption(CLI::App& command, int& threads);

// An option that takes one of `names`, which stand for values of an enum. The value that it has
// shows as the default.
template <typename Enum>
CLI::Option* AddChoice(CLI::App& command, const std::string& name, Enum& value,
                       const std::vector<std::pair<std::string, Enum>>& names,
                       const std::string& description) {
  std::vector<std::string> known;
  std::string standard;
  for (const auto& [text, meaning] : names) {
    known.push_back(text);
    if (meaning == value) standard = text;
  }
  const auto assign = [&value, names](const std::string& text) {
    for (const auto& [known_text, meaning] : names) {
      if (text == known_text) value = meaning;
    }
  };
  return command.add_option_function<std::string>(name, assign, description)
      ->check(CLI::IsMember(known))
      ->default_str(standard);
}

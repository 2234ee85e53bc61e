// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Three kinds of error, three means: a broken contract throws ContractViolation (MLVI_CHECK); bad
// external data is an Expected<T> whose Error says what was found, the numbers, the likely cause
// and the remedy; an expected outcome of estimation is an enum or an optional of the function
// concerned. Libraries never exit, print or swallow.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace mlvi {

enum class ErrorKind {
  kConfiguration,  // usage, configuration or rig: exit code 1
  kInput,          // unreadable or insufficient input: exit code 2
  kEstimation,     // estimation failed: exit code 3
};

struct Error {
  ErrorKind kind = ErrorKind::kInput;
  std::string message;
};

template <typename T>
using Expected = tl::expected<T, Error>;

template <typename... Args>
tl::unexpected<Error> MakeError(ErrorKind kind, fmt::format_string<Args...> format,
                                Args&&... args) {
  return tl::unexpected<Error>(Error{kind, fmt::format(format, std::forward<Args>(args)...)});
}

// A caller broke the contract of a function: a programming error, with place and values.
class ContractViolation : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

namespace internal {
[[noreturn]] inline void ThrowViolation(const char* file, int line, const std::string& what) {
  throw ContractViolation(fmt::format("{}:{}: {}", file, line, what));
}
}  // namespace internal

}  // namespace mlvi

// MLVI_CHECK(condition, "format", args...): the message must give the values.
#define MLVI_CHECK(condition, ...)                                                            \
  do {                                                                                        \
    if (!(condition)) {                                                                       \
      ::mlvi::internal::ThrowViolation(                                                       \
          __FILE__, __LINE__, "check failed: " #condition ": " + ::fmt::format(__VA_ARGS__)); \
    }                                                                                         \
  } while (false)

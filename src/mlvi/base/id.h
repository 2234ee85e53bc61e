// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace mlvi {

// A strong index: ids of different tags do not mix, and the default value is invalid.
template <typename Tag>
class Id {
 public:
  constexpr Id() = default;
  explicit constexpr Id(std::int64_t value) : value_(value) {}

  constexpr bool valid() const { return value_ >= 0; }
  constexpr std::int64_t value() const { return value_; }
  constexpr auto operator<=>(const Id&) const = default;

 private:
  std::int64_t value_ = -1;
};

}  // namespace mlvi

template <typename Tag>
struct std::hash<mlvi::Id<Tag>> {
  std::size_t operator()(mlvi::Id<Tag> id) const noexcept {
    return std::hash<std::int64_t>()(id.value());
  }
};

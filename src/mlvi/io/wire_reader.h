// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "mlvi/base/time.h"

namespace mlvi {

static_assert(std::endian::native == std::endian::little, "ROS messages are little-endian");

using ByteSpan = std::span<const std::uint8_t>;

// Reads serialised ROS 1 data front to back. A read beyond the end yields zero, and ok() is false
// from then on: so a parser reads all fields and checks once.
class WireReader {
 public:
  explicit WireReader(ByteSpan bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

  template <typename T>
  T Read() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    const ByteSpan raw = Bytes(sizeof(T));
    if (raw.size() == sizeof(T)) std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  // `count` bytes, without a copy; empty when fewer are left.
  ByteSpan Bytes(std::size_t count) {
    if (!ok_ || count > remaining()) {
      ok_ = false;
      return {};
    }
    const ByteSpan bytes = bytes_.subspan(position_, count);
    position_ += count;
    return bytes;
  }
  // A uint32 length and that many bytes.
  ByteSpan Block() { return Bytes(Read<std::uint32_t>()); }
  std::string_view Text() {
    const ByteSpan block = Block();
    return {reinterpret_cast<const char*>(block.data()), block.size()};
  }
  // Seconds and nanoseconds, uint32 each.
  Time ReadTime() {
    const std::int64_t seconds = Read<std::uint32_t>();
    const std::int64_t nanoseconds = Read<std::uint32_t>();
    return Time::FromNanoseconds(seconds * 1'000'000'000 + nanoseconds);
  }

 private:
  ByteSpan bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace mlvi

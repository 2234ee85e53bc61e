// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "mlvi/io/wire_reader.h"

namespace mlvi {

struct Decompressed {
  std::vector<std::uint8_t> bytes;
  // False: the input is damaged or cut short, `bytes` is what could be had before that.
  bool complete = false;
};

// Decompresses one chunk of a ROS bag. `compression` is "none", "bz2" or "lz4"; another name yields
// nothing. `size` is the size that the bag claims for the result; more is never produced.
Decompressed DecompressChunk(std::string_view compression, ByteSpan input, std::size_t size);

}  // namespace mlvi

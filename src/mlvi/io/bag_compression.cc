// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/bag_compression.h"

#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>

namespace mlvi {
namespace {

// A damaged bag may claim any size: memory is taken as data arrives.
constexpr std::size_t kStep = std::size_t{4} << 20;

// Calls step(output, room) -> bytes written or -1 at the end of what can be had, until `size` bytes
// are there.
template <typename Step>
void Fill(std::vector<std::uint8_t>& output, std::size_t size, const Step& step) {
  std::size_t filled = 0;
  while (filled < size) {
    output.resize(std::min(size, filled + kStep));
    const std::ptrdiff_t written = step(output.data() + filled, output.size() - filled);
    if (written < 0) break;
    filled += static_cast<std::size_t>(written);
  }
  output.resize(filled);
}

Decompressed DecompressBz2(ByteSpan input, std::size_t size) {
  Decompressed result;
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return result;
  // The interface of libbz2 wants a pointer to non-const, but does not write through it.
  stream.next_in = reinterpret_cast<char*>(const_cast<std::uint8_t*>(input.data()));
  stream.avail_in = static_cast<unsigned>(input.size());
  int code = BZ_OK;
  bool ended = false;
  Fill(result.bytes, size, [&](std::uint8_t* output, std::size_t room) -> std::ptrdiff_t {
    if (ended) return -1;
    stream.next_out = reinterpret_cast<char*>(output);
    stream.avail_out = static_cast<unsigned>(room);
    code = BZ2_bzDecompress(&stream);
    const auto written = static_cast<std::ptrdiff_t>(room - stream.avail_out);
    ended = code != BZ_OK || written == 0;
    return written;
  });
  // One more call, without room, reaches the checksum behind the last byte.
  stream.avail_out = 0;
  const bool checksum_good =
      code == BZ_STREAM_END || (code == BZ_OK && BZ2_bzDecompress(&stream) == BZ_STREAM_END);
  BZ2_bzDecompressEnd(&stream);
  result.complete = result.bytes.size() == size && checksum_good;
  return result;
}

Decompressed DecompressLz4(ByteSpan input, std::size_t size) {
  Decompressed result;
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return result;
  std::size_t position = 0;
  bool finished = false, stuck = false;
  const auto step = [&](std::uint8_t* output, std::size_t room) -> std::ptrdiff_t {
    if (finished || stuck) return -1;
    std::size_t written = room, read = input.size() - position;
    const std::size_t code =
        LZ4F_decompress(context, output, &written, input.data() + position, &read, nullptr);
    stuck = LZ4F_isError(code) != 0 || (written == 0 && read == 0);
    if (stuck) return -1;
    position += read;
    finished = code == 0;
    return static_cast<std::ptrdiff_t>(written);
  };
  Fill(result.bytes, size, step);
  // Without room the end mark and the checksum behind the last byte are reached.
  std::uint8_t nothing = 0;
  while (step(&nothing, 0) >= 0) continue;
  LZ4F_freeDecompressionContext(context);
  result.complete = result.bytes.size() == size && finished;
  return result;
}

}  // namespace

Decompressed DecompressChunk(std::string_view compression, ByteSpan input, std::size_t size) {
  if (compression == "bz2") return DecompressBz2(input, size);
  if (compression == "lz4") return DecompressLz4(input, size);
  if (compression != "none") return {};
  const std::size_t available = std::min(size, input.size());
  return {.bytes = {input.begin(), input.begin() + static_cast<std::ptrdiff_t>(available)},
          .complete = available == size};
}

}  // namespace mlvi

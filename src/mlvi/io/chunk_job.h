// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mlvi/base/background_tasks.h"
#include "mlvi/io/bag_compression.h"

namespace mlvi {

// A chunk as it lies in the file.
struct PackedChunk {
  std::string compression;  // "none", "bz2" or "lz4"
  std::uint32_t size = 0;   // unpacked, as the bag claims
  std::vector<std::uint8_t> bytes;
  std::uint64_t packed_size = 0;  // of `bytes` when they were read
  bool cut_off = false;           // the file ends before the chunk does
};

// One chunk that is being unpacked by whichever thread is free.
class ChunkJob {
 public:
  // `background` must outlive the job.
  ChunkJob(BackgroundTasks& background, PackedChunk packed);
  ~ChunkJob();
  ChunkJob(ChunkJob&&) noexcept;
  ChunkJob& operator=(ChunkJob&&) = delete;

  // What is unpacked; without its bytes once that is done.
  const PackedChunk& packed() const;
  // Waits for the end of the work. Call once.
  Decompressed Take();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace mlvi

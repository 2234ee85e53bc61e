// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/chunk_job.h"

#include <optional>

namespace mlvi {

// At a fixed address: the task writes into it.
struct ChunkJob::Work {
  PackedChunk packed;
  Decompressed unpacked;
  std::optional<BackgroundTasks::Task> task;  // last: it ends before what it uses
};

ChunkJob::ChunkJob(BackgroundTasks& background, PackedChunk packed)
    : work_(std::make_unique<Work>()) {
  work_->packed = std::move(packed);
  work_->task.emplace(background.Run([work = work_.get()] {
    PackedChunk& chunk = work->packed;
    work->unpacked = DecompressChunk(chunk.compression, chunk.bytes, chunk.size);
    chunk.bytes = {};
  }));
}

ChunkJob::~ChunkJob() = default;
ChunkJob::ChunkJob(ChunkJob&&) noexcept = default;

const PackedChunk& ChunkJob::packed() const { return work_->packed; }

Decompressed ChunkJob::Take() {
  work_->task->Wait();
  return std::move(work_->unpacked);
}

}  // namespace mlvi

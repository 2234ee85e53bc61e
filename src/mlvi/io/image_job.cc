// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_job.h"

#include <optional>

#include "mlvi/io/image_decoder.h"
#include "mlvi/io/ros_messages.h"

namespace mlvi {

// At a fixed address: the task writes into it.
struct ImageJob::Work {
  std::vector<std::uint8_t> bytes;
  bool compressed = false;
  Expected<Image> image;
  std::optional<BackgroundTasks::Task> task;  // last: it ends before what it uses

  void Decode() {
    if (compressed) {
      image = ParseCompressedImage(bytes).and_then(DecodeCompressedImage);
    } else {
      image = ParseImage(bytes).and_then(DecodeImage);
    }
  }
};

ImageJob::ImageJob(BackgroundTasks& background, ByteSpan message, bool compressed)
    : work_(std::make_unique<Work>()) {
  work_->bytes.assign(message.begin(), message.end());
  work_->compressed = compressed;
  work_->task.emplace(background.Run([work = work_.get()] { work->Decode(); }));
}

ImageJob::~ImageJob() = default;
ImageJob::ImageJob(ImageJob&&) noexcept = default;

Expected<Image> ImageJob::Take() {
  work_->task->Wait();
  return std::move(work_->image);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "mlvi/base/background_tasks.h"
#include "mlvi/base/error.h"
#include "mlvi/io/wire_reader.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// One image message that is being decoded by whichever thread is free.
class ImageJob {
 public:
  // Copies `message` (serialised sensor_msgs/Image, or CompressedImage) and starts. `background`
  // must outlive the job.
  ImageJob(BackgroundTasks& background, ByteSpan message, bool compressed);
  ~ImageJob();
  ImageJob(ImageJob&&) noexcept;
  ImageJob& operator=(ImageJob&&) = delete;

  // The grey image, or why it cannot be decoded (DecodeImage, DecodeCompressedImage). Call once.
  Expected<Image> Take();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace mlvi

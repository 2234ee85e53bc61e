// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_encoder.h"

#include <opencv2/imgcodecs.hpp>

namespace mlvi {
namespace {

// A view of the image's pixels: OpenCV takes a pointer to non-const; the image is only read.
cv::Mat ViewOf(const Image& image) {
  const auto bytes = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                     static_cast<std::size_t>(image.channels);
  MLVI_CHECK(bytes == image.pixels.size() && bytes > 0, "{} x {} x {} channels with {} bytes", image.width,
             image.height, image.channels, image.pixels.size());
  return cv::Mat(image.height, image.width, image.channels == 3 ? CV_8UC3 : CV_8UC1,
                 const_cast<std::uint8_t*>(image.pixels.data()));
}

}  // namespace

Expected<std::vector<std::uint8_t>> EncodeJpeg(const Image& image, int quality) {
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode(".jpg", ViewOf(image), bytes, {cv::IMWRITE_JPEG_QUALITY, quality})) return bytes;
  } catch (const cv::Exception&) {
  }
  return MakeError(ErrorKind::kInput, "an image of {} x {} cannot be encoded as JPEG", image.width, image.height);
}

Expected<void> WriteImage(const Image& image, const std::string& path) {
  try {
    if (cv::imwrite(path, ViewOf(image))) return {};
  } catch (const cv::Exception&) {
  }
  return MakeError(ErrorKind::kInput, "cannot write the image {}; does the folder exist, is the disk full?", path);
}

}  // namespace mlvi

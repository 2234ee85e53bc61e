// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_encoder.h"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "mlvi/io/whole_file.h"

namespace mlvi {
namespace {

// A view of the image's pixels: OpenCV takes a pointer to non-const; the image is only read.
cv::Mat ViewOf(const Image& image) {
  const auto bytes = static_cast<std::size_t>(image.width) *
                     static_cast<std::size_t>(image.height) *
                     static_cast<std::size_t>(image.channels);
  MLVI_CHECK(bytes == image.pixels.size() && bytes > 0, "{} x {} x {} channels with {} bytes",
             image.width, image.height, image.channels, image.pixels.size());
  return cv::Mat(image.height, image.width, image.channels == 3 ? CV_8UC3 : CV_8UC1,
                 const_cast<std::uint8_t*>(image.pixels.data()));
}

}  // namespace

Expected<std::vector<std::uint8_t>> EncodeJpeg(const Image& image, int quality) {
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode(".jpg", ViewOf(image), bytes, {cv::IMWRITE_JPEG_QUALITY, quality}))
      return bytes;
  } catch (const cv::Exception&) {
  }
  return MakeError(ErrorKind::kInput, "an image of {} x {} cannot be encoded as JPEG", image.width,
                   image.height);
}

Expected<void> WriteImage(const Image& image, const std::string& path) {
  // Encoded in memory: OpenCV does not tell of a file that it could not write to its end.
  std::vector<std::uint8_t> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(std::filesystem::path(path).extension().string(), ViewOf(image), bytes);
  } catch (const cv::Exception&) {
  }
  MLVI_CHECK(encoded, "an image of {} x {} is not to be encoded as '{}'", image.width, image.height,
             path);
  return WriteWholeFile(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace mlvi

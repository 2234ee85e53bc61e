// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_decoder.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace mlvi {
namespace {

Image FromMat(const cv::Mat& grey, Time stamp) {
  Image image;
  image.stamp = stamp;
  image.width = grey.cols;
  image.height = grey.rows;
  image.pixels.reserve(grey.total());
  for (int row = 0; row < grey.rows; ++row) {
    image.pixels.insert(image.pixels.end(), grey.ptr<std::uint8_t>(row), grey.ptr<std::uint8_t>(row) + grey.cols);
  }
  return image;
}

}  // namespace

Expected<Image> DecodeImage(const ImageView& view) {
  const bool grey = view.encoding == "mono8" || view.encoding == "8UC1";
  const bool bgr = view.encoding == "bgr8", rgb = view.encoding == "rgb8";
  if (!grey && !bgr && !rgb) {
    return MakeError(ErrorKind::kInput, "image encoding '{}' is not supported; mono8, bgr8 and rgb8 are", view.encoding);
  }
  const std::uint64_t row_bytes = std::uint64_t{view.width} * (grey ? 1 : 3);
  const std::uint64_t bytes = std::uint64_t{view.step} * view.height;
  if (view.width == 0 || view.height == 0 || view.width > 65536 || view.height > 65536 || view.step < row_bytes ||
      bytes > view.data.size()) {
    return MakeError(ErrorKind::kInput, "image of {} x {} pixels with step {} does not fit its {} bytes of data",
                     view.width, view.height, view.step, view.data.size());
  }
  // OpenCV takes a pointer to non-const; the image is only read.
  const cv::Mat raw(static_cast<int>(view.height), static_cast<int>(view.width), grey ? CV_8UC1 : CV_8UC3,
                    const_cast<std::uint8_t*>(view.data.data()), view.step);
  if (grey) return FromMat(raw, view.header.stamp);
  cv::Mat converted;
  cv::cvtColor(raw, converted, bgr ? cv::COLOR_BGR2GRAY : cv::COLOR_RGB2GRAY);
  return FromMat(converted, view.header.stamp);
}

Expected<Image> DecodeCompressedImage(const ImageView& view) {
  cv::Mat grey;
  try {
    const cv::Mat raw(1, static_cast<int>(view.data.size()), CV_8UC1, const_cast<std::uint8_t*>(view.data.data()));
    if (!view.data.empty()) grey = cv::imdecode(raw, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    grey.release();
  }
  if (grey.empty()) {
    return MakeError(ErrorKind::kInput, "compressed image of {} bytes (format '{}') cannot be decoded",
                     view.data.size(), view.encoding);
  }
  return FromMat(grey, view.header.stamp);
}

}  // namespace mlvi

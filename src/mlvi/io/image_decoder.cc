// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_decoder.h"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace mlvi {
namespace {

constexpr std::uint32_t kMaxSide = 65536;  // px

// How a raw encoding becomes grey; no conversion: it is.
struct Encoding {
  std::string_view name;
  int channels = 1;
  std::optional<cv::ColorConversionCodes> to_grey;
};

// OpenCV names a Bayer pattern by the second and third pixel of its second row, ROS by its first
// four pixels.
constexpr std::array<Encoding, 11> kEncodings = {{
    {"mono8", 1, {}},
    {"8UC1", 1, {}},
    {"bgr8", 3, cv::COLOR_BGR2GRAY},
    {"8UC3", 3, cv::COLOR_BGR2GRAY},
    {"rgb8", 3, cv::COLOR_RGB2GRAY},
    {"bgra8", 4, cv::COLOR_BGRA2GRAY},
    {"rgba8", 4, cv::COLOR_RGBA2GRAY},
    {"bayer_rggb8", 1, cv::COLOR_BayerBG2GRAY},
    {"bayer_bggr8", 1, cv::COLOR_BayerRG2GRAY},
    {"bayer_gbrg8", 1, cv::COLOR_BayerGR2GRAY},
    {"bayer_grbg8", 1, cv::COLOR_BayerGB2GRAY},
}};

const Encoding* FindEncoding(std::string_view name) {
  const auto found = std::find_if(kEncodings.begin(), kEncodings.end(),
                                  [&](const Encoding& e) { return e.name == name; });
  return found == kEncodings.end() ? nullptr : &*found;
}

std::string EncodingNames() {
  std::string names;
  for (const Encoding& encoding : kEncodings)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", encoding.name);
  return names;
}

Image FromMat(const cv::Mat& grey, Time stamp) {
  Image image;
  image.stamp = stamp;
  image.width = grey.cols;
  image.height = grey.rows;
  image.pixels.reserve(grey.total());
  for (int row = 0; row < grey.rows; ++row) {
    image.pixels.insert(image.pixels.end(), grey.ptr<std::uint8_t>(row),
                        grey.ptr<std::uint8_t>(row) + grey.cols);
  }
  return image;
}

Image ToGrey(const cv::Mat& raw, const Encoding& encoding, Time stamp) {
  if (!encoding.to_grey) return FromMat(raw, stamp);
  cv::Mat grey;
  cv::cvtColor(raw, grey, *encoding.to_grey);
  return FromMat(grey, stamp);
}

// A JPEG without an end marker: the decoder would fill what is missing with grey. Padding behind
// the marker is allowed.
bool IsCutJpeg(ByteSpan data) {
  constexpr std::array<std::uint8_t, 2> kStart = {0xff, 0xd8}, kEnd = {0xff, 0xd9};
  constexpr std::size_t kMostPadding = 64;
  if (data.size() < kStart.size() || !std::equal(kStart.begin(), kStart.end(), data.begin()))
    return false;
  const auto tail = data.last(std::min(data.size(), kMostPadding + kEnd.size()));
  return std::search(tail.begin(), tail.end(), kEnd.begin(), kEnd.end()) == tail.end();
}

}  // namespace

Expected<Image> DecodeImage(const ImageView& view) {
  const Encoding* encoding = FindEncoding(view.encoding);
  if (encoding == nullptr) {
    return MakeError(ErrorKind::kInput, "image encoding '{}' is not supported; these are: {}",
                     view.encoding, EncodingNames());
  }
  const std::uint64_t row_bytes =
      std::uint64_t{view.width} * static_cast<std::uint64_t>(encoding->channels);
  const std::uint64_t bytes = std::uint64_t{view.step} * view.height;
  if (view.width == 0 || view.height == 0 || view.width > kMaxSide || view.height > kMaxSide ||
      view.step < row_bytes || bytes > view.data.size()) {
    return MakeError(ErrorKind::kInput,
                     "image of {} x {} pixels with step {} does not fit its {} bytes of data",
                     view.width, view.height, view.step, view.data.size());
  }
  // OpenCV takes a pointer to non-const; the image is only read.
  const cv::Mat raw(static_cast<int>(view.height), static_cast<int>(view.width),
                    CV_8UC(encoding->channels), const_cast<std::uint8_t*>(view.data.data()),
                    view.step);
  return ToGrey(raw, *encoding, view.header.stamp);
}

Expected<Image> DecodeCompressedImage(const ImageView& view) {
  if (IsCutJpeg(view.data)) {
    return MakeError(ErrorKind::kInput, "JPEG image of {} bytes is cut short: it has no end marker",
                     view.data.size());
  }
  cv::Mat grey;
  try {
    const cv::Mat raw(1, static_cast<int>(view.data.size()), CV_8UC1,
                      const_cast<std::uint8_t*>(view.data.data()));
    // The lens model belongs to the pixels as stored, whatever orientation a camera wrote beside
    // them.
    if (!view.data.empty())
      grey = cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    grey.release();
  }
  if (grey.empty() || grey.cols > int{kMaxSide} || grey.rows > int{kMaxSide}) {
    return MakeError(ErrorKind::kInput,
                     "compressed image of {} bytes (format '{}') cannot be decoded",
                     view.data.size(), view.encoding);
  }
  // "bayer_rggb8; png compressed": the mosaic itself; with "bgr8" behind it, colours that were made
  // of it.
  const Encoding* encoding = FindEncoding(view.encoding.substr(0, view.encoding.find(';')));
  const bool mosaic = encoding != nullptr && encoding->name.starts_with("bayer") &&
                      !view.encoding.ends_with("bgr8");
  return mosaic ? ToGrey(grey, *encoding, view.header.stamp) : FromMat(grey, view.header.stamp);
}

}  // namespace mlvi

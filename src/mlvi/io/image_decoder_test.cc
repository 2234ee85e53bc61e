// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/image_decoder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mlvi/base/random.h"
#include "mlvi/io/image_encoder.h"
#include "mlvi/io/ros_serialization.h"

namespace mlvi {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

constexpr int kWidth = 16, kHeight = 12;

ImageView Raw(std::string_view encoding, int channels, const std::vector<std::uint8_t>& data) {
  return {.header = {},
          .height = kHeight,
          .width = kWidth,
          .step = static_cast<std::uint32_t>(kWidth * channels),
          .encoding = encoding,
          .data = data};
}

// Pixels that repeat `pattern`, one entry per channel.
std::vector<std::uint8_t> Flat(const std::vector<std::uint8_t>& pattern) {
  std::vector<std::uint8_t> data;
  for (int i = 0; i < kWidth * kHeight; ++i)
    data.insert(data.end(), pattern.begin(), pattern.end());
  return data;
}

// The mosaic that a sensor of 2 x 2 `letters` (row by row) delivers of one colour.
std::vector<std::uint8_t> Mosaic(const std::string& letters, int red, int green, int blue) {
  std::vector<std::uint8_t> data;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const char letter = letters[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
      data.push_back(static_cast<std::uint8_t>(letter == 'r' ? red : letter == 'g' ? green : blue));
    }
  }
  return data;
}

// Luma by ITU-R BT.601.
double Luma(double red, double green, double blue) {
  return 0.299 * red + 0.587 * green + 0.114 * blue;
}

void ExpectGrey(const Expected<Image>& image, double grey, const std::string& encoding) {
  ASSERT_TRUE(image) << image.error().message;
  ASSERT_EQ(image->width, kWidth);
  ASSERT_EQ(image->height, kHeight);
  for (const std::uint8_t pixel : image->pixels) ASSERT_NEAR(pixel, grey, 1.0) << encoding;
}

TEST(ImageDecoder, ColoursBecomeGreyByTheirLuma) {
  const double grey = Luma(200, 100, 30);
  ExpectGrey(DecodeImage(Raw("rgb8", 3, Flat({200, 100, 30}))), grey, "rgb8");
  ExpectGrey(DecodeImage(Raw("bgr8", 3, Flat({30, 100, 200}))), grey, "bgr8");
  ExpectGrey(DecodeImage(Raw("8UC3", 3, Flat({30, 100, 200}))), grey, "8UC3");
  ExpectGrey(DecodeImage(Raw("rgba8", 4, Flat({200, 100, 30, 9}))), grey, "rgba8");
  ExpectGrey(DecodeImage(Raw("bgra8", 4, Flat({30, 100, 200, 9}))), grey, "bgra8");
  ExpectGrey(DecodeImage(Raw("mono8", 1, Flat({77}))), 77, "mono8");
}

TEST(ImageDecoder, BayerPatternsAreNamedByTheirFirstFourPixels) {
  for (const std::string letters : {"rggb", "bggr", "gbrg", "grbg"}) {
    const std::vector<std::uint8_t> red = Mosaic(letters, 200, 0, 0),
                                    blue = Mosaic(letters, 0, 0, 200);
    const std::string encoding = "bayer_" + letters + "8";
    ExpectGrey(DecodeImage(Raw(encoding, 1, red)), Luma(200, 0, 0), encoding);
    ExpectGrey(DecodeImage(Raw(encoding, 1, blue)), Luma(0, 0, 200), encoding);
  }
}

TEST(ImageDecoder, RowsMayBePadded) {
  std::vector<std::uint8_t> data(static_cast<std::size_t>((kWidth + 5) * kHeight), 200);
  for (int y = 0; y < kHeight; ++y) std::fill_n(data.begin() + y * (kWidth + 5), kWidth, 50);
  ImageView view = Raw("mono8", 1, data);
  view.step = kWidth + 5;
  ExpectGrey(DecodeImage(view), 50, "padded");
}

TEST(ImageDecoder, ContradictingSizesAndUnknownEncodingsAreErrors) {
  const std::vector<std::uint8_t> data = Flat({1});
  ImageView view = Raw("mono8", 1, data);
  view.height = kHeight + 1;
  EXPECT_THAT(DecodeImage(view).error().message, HasSubstr("does not fit its 192 bytes"));
  EXPECT_THAT(DecodeImage(Raw("rgb8", 1, data)).error().message, HasSubstr("does not fit"));
  EXPECT_THAT(DecodeImage(Raw("mono16", 1, data)).error().message,
              HasSubstr("'mono16' is not supported; these are: mono8, 8UC1, bgr8"));
}

class CompressedImages : public ::testing::Test {
 protected:
  static Expected<Image> Decode(const std::vector<std::uint8_t>& bytes, const std::string& format) {
    return DecodeCompressedImage({.header = {}, .encoding = format, .data = bytes});
  }
  static std::vector<std::uint8_t> Jpeg(std::vector<std::uint8_t> pixels, int channels) {
    const auto bytes = EncodeJpeg(
        {.width = kWidth, .height = kHeight, .channels = channels, .pixels = std::move(pixels)},
        95);
    EXPECT_TRUE(bytes);
    return *bytes;
  }
};

TEST_F(CompressedImages, GreyAndColourJpegsAreRead) {
  ExpectGrey(Decode(Jpeg(Flat({90}), 1), "mono8; jpeg compressed "), 90, "grey");
  ExpectGrey(Decode(Jpeg(Flat({30, 100, 200}), 3), "bgr8; jpeg compressed bgr8"),
             Luma(200, 100, 30), "colour");
  ExpectGrey(Decode(Jpeg(Flat({30, 100, 200}), 3), "bayer_rggb8; jpeg compressed bgr8"),
             Luma(200, 100, 30), "colour");
}

TEST_F(CompressedImages, DamagedOnesAreErrorsOrImagesButNeverMore) {
  const std::vector<std::uint8_t> good = Jpeg(Flat({90}), 1);
  EXPECT_THAT(Decode({}, "jpeg").error().message,
              HasSubstr("of 0 bytes (format 'jpeg') cannot be decoded"));
  EXPECT_FALSE(Decode(std::vector<std::uint8_t>(500, 7), "png"));
  // The decoder would fill the missing part with grey.
  const std::vector<std::uint8_t> cut(good.begin(), good.end() - 10);
  EXPECT_THAT(Decode(cut, "jpeg").error().message, HasSubstr("cut short"));
  RandomStream random(1);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> bytes = good;
    if (i % 2 == 0)
      bytes.resize(static_cast<std::size_t>(random.Uniform() * static_cast<double>(good.size())));
    for (int flips = 0; flips < 3 && !bytes.empty(); ++flips) {
      const auto at =
          static_cast<std::size_t>(random.Uniform() * static_cast<double>(bytes.size()));
      bytes[at] = static_cast<std::uint8_t>(256.0 * random.Uniform());
    }
    const auto image = Decode(bytes, "mono8; jpeg compressed ");
    if (image) {
      EXPECT_EQ(image->pixels.size(),
                static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
    } else {
      EXPECT_THAT(image.error().message,
                  AnyOf(HasSubstr("cannot be decoded"), HasSubstr("cut short")));
    }
  }
}

}  // namespace
}  // namespace mlvi

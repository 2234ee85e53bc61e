// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "range_colours.h"

#include <algorithm>
#include <cmath>

using namespace mlvi;

Colour ColourOfRange(double range) {
  const double x = std::clamp(std::log(range) / std::log(40.0), 0.0, 1.0);
  const auto level = [](double v) {
    return static_cast<std::uint8_t>(255.0 * std::clamp(v, 0.0, 1.0));
  };
  return {level(2.0 * x - 1.0), level(1.0 - std::abs(2.0 * x - 1.0)), level(1.0 - 2.0 * x)};
}

Image Coloured(const Image& image) {
  if (image.channels == 3) return image;
  Image result = image;
  result.channels = 3;
  result.pixels.clear();
  for (const std::uint8_t grey : image.pixels)
    result.pixels.insert(result.pixels.end(), {grey, grey, grey});
  return result;
}

void Paint(Image& image, int column, int row, Colour colour) {
  const auto at = 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                       static_cast<std::size_t>(column));
  image.pixels[at] = colour.blue;
  image.pixels[at + 1] = colour.green;
  image.pixels[at + 2] = colour.red;
}

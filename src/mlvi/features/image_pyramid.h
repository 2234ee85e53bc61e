// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

struct PyramidConfig {
  int levels = 3;      // halvings above the full image
  int window_px = 21;  // side of the windows that will be tracked in it, odd
  bool equalise = false;
  double equalise_clip = 3.0;
  void Declare(ConfigDeclaration& d);
};

// A grey image at falling resolutions with its derivatives: what tracking reads, made once per
// image. Copies share their pixels.
struct ImagePyramid {
  cv::Mat image;  // level 0 without border, 8 bit: what detection reads
  std::vector<cv::Mat>
      levels;  // image, derivatives, image, derivatives, ... with borders of a window

  bool empty() const { return levels.empty(); }
  int width() const { return image.cols; }
  int height() const { return image.rows; }
};

// With config.equalise, contrast is equalised first (CLAHE, 8 x 8 tiles): for dark and unevenly lit
// scenes.
ImagePyramid BuildPyramid(const Image& image, const PyramidConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/image_pyramid.h"

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace mlvi {
namespace {

constexpr int kEqualiserTiles = 8;

}  // namespace

void PyramidConfig::Declare(ConfigDeclaration& d) {
  d.Field("levels", levels, "", "Halvings of the image; each doubles the flow that can be followed",
          {0.0, 6.0});
  d.Field("window_px", window_px, "px", "Side of a tracked window, odd", {5.0, 63.0});
  d.Field("equalise", equalise, "Equalise contrast (CLAHE) before detection and tracking");
  d.Field("equalise_clip", equalise_clip, "",
          "Most that equalisation may raise contrast, as a multiple of an even histogram",
          {1.0, 40.0});
}

ImagePyramid BuildPyramid(const Image& image, const PyramidConfig& config) {
  MLVI_CHECK(image.width > 0 && image.height > 0 &&
                 image.pixels.size() ==
                     static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
             "image of {} x {} px with {} bytes", image.width, image.height, image.pixels.size());
  // OpenCV has no constant view of foreign pixels; nothing writes through this one.
  const cv::Mat view(image.height, image.width, CV_8UC1,
                     const_cast<std::uint8_t*>(image.pixels.data()));
  ImagePyramid pyramid;
  if (config.equalise) {
    cv::createCLAHE(config.equalise_clip, {kEqualiserTiles, kEqualiserTiles})
        ->apply(view, pyramid.image);
  } else {
    pyramid.image = view;
  }
  cv::buildOpticalFlowPyramid(pyramid.image, pyramid.levels, {config.window_px, config.window_px},
                              config.levels, true, cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT,
                              false);
  pyramid.image = pyramid.levels[0];  // the pyramid's copy, which outlives `image`
  return pyramid;
}

}  // namespace mlvi

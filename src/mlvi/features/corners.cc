// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/corners.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace mlvi {
namespace {

constexpr int kTileBlocks =
    8;  // blocks per side of a tile, the unit in which responses are computed
constexpr int kSobel = 3;
// cv::cornerMinEigenVal of an image with the gradient g (grey values per px) is (2 g / 255)^2.
constexpr double kResponsePerTexture = 4.0 / (255.0 * 255.0);

struct Strongest {
  float response = 0.0F;
  int x = 0, y = 0;
};

bool IsWanted(const RegionMap& regions, std::span<const std::uint8_t> wanted, int column, int row) {
  const int region = regions.At(column, row);
  return region != RegionMap::kNone && wanted[static_cast<std::size_t>(region)] != 0;
}

bool IsLocalMaximum(const cv::Mat1f& response, int x, int y) {
  const float value = response(y, x);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (response(y + dy, x + dx) > value) return false;
    }
  }
  return true;
}

// Updates the strongest corners by one block. `response` holds the pixels from `origin` on.
void ScanBlock(const cv::Mat1f& response, cv::Point origin, cv::Rect block, Strongest& strongest) {
  for (int y = block.y; y < block.y + block.height; ++y) {
    const float* row = response.ptr<float>(y - origin.y) - origin.x;
    for (int x = block.x; x < block.x + block.width; ++x) {
      if (row[x] > strongest.response && IsLocalMaximum(response, x - origin.x, y - origin.y)) {
        strongest = {row[x], x, y};
      }
    }
  }
}

// The blocks of one tile; responses are computed for the rectangle around its wanted ones.
void ScanTile(const cv::Mat& image, const RegionMap& regions, std::span<const std::uint8_t> wanted,
              cv::Rect tile, const CornerConfig& config, std::vector<Strongest>& strongest) {
  // The window, its gradients and the neighbours of a maximum reach this far.
  const int margin = config.window_px / 2 + 2;
  const cv::Rect interior(margin, margin, image.cols - 2 * margin, image.rows - 2 * margin);
  cv::Rect needed;
  std::vector<std::pair<cv::Rect, int>> blocks;
  for (int row = tile.y; row < tile.y + tile.height; ++row) {
    for (int column = tile.x; column < tile.x + tile.width; ++column) {
      if (!IsWanted(regions, wanted, column, row)) continue;
      constexpr int kSide = RegionMap::kBlock;
      const cv::Rect block = cv::Rect(column * kSide, row * kSide, kSide, kSide) & interior;
      if (block.empty()) continue;
      needed = needed.empty() ? block : needed | block;
      blocks.emplace_back(block, regions.At(column, row));
    }
  }
  if (blocks.empty()) return;
  const cv::Rect read(needed.x - margin, needed.y - margin, needed.width + 2 * margin,
                      needed.height + 2 * margin);
  cv::Mat1f response;
  cv::cornerMinEigenVal(image(read), response, config.window_px, kSobel);
  for (const auto& [block, region] : blocks) {
    ScanBlock(response, read.tl(), block, strongest[static_cast<std::size_t>(region)]);
  }
}

}  // namespace

void CornerConfig::Declare(ConfigDeclaration& d) {
  d.Field("window_px", window_px, "px", "Side of the window of a corner, odd", {3.0, 31.0});
  d.Field("min_texture", min_texture, "1/px",
          "Grey values per pixel, root mean square over the window along its weakest direction",
          {0.0, 255.0});
  d.Field("max_position_sigma", max_position_sigma, "px",
          "By which a noise as strong as its contrast may move the window of a corner, one sigma",
          {0.01, 100.0});
}

std::vector<Corner> DetectCorners(const ImagePyramid& pyramid, const RegionMap& regions,
                                  std::span<const std::uint8_t> wanted,
                                  const CornerConfig& config) {
  MLVI_CHECK(regions.width() == pyramid.width() && regions.height() == pyramid.height(),
             "regions of {} x {} px, image of {} x {}", regions.width(), regions.height(),
             pyramid.width(), pyramid.height());
  const float least =
      static_cast<float>(config.min_texture * config.min_texture * kResponsePerTexture);
  std::vector<Strongest> strongest(wanted.size(), Strongest{.response = least});
  const cv::Rect all(0, 0, regions.columns(), regions.rows());
  for (int row = 0; row < regions.rows(); row += kTileBlocks) {
    for (int column = 0; column < regions.columns(); column += kTileBlocks) {
      const cv::Rect tile = cv::Rect(column, row, kTileBlocks, kTileBlocks) & all;
      ScanTile(pyramid.image, regions, wanted, tile, config, strongest);
    }
  }
  std::vector<Corner> corners;
  for (std::size_t region = 0; region < strongest.size(); ++region) {
    const Strongest& s = strongest[region];
    if (!(s.response > least)) continue;
    corners.push_back({.pixel = Eigen::Vector2d(s.x, s.y),
                       .region = static_cast<int>(region),
                       .texture = std::sqrt(s.response / kResponsePerTexture)});
  }
  return corners;
}

void JudgeCorners(const ImagePyramid& pyramid, const CornerConfig& config,
                  const PatchConfig& patch_config, std::vector<Corner>& corners) {
  std::erase_if(corners, [&](Corner& corner) {
    const auto patch = Patch::Cut(pyramid, corner.pixel, patch_config);
    if (!patch) return true;
    corner.position_sigma = patch->position_sigma();
    return corner.position_sigma > config.max_position_sigma;
  });
}

}  // namespace mlvi

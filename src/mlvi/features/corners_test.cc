// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/corners.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "mlvi/features/testing.h"

namespace mlvi {
namespace {

constexpr int kWidth = 331, kHeight = 250;  // no multiple of a block

ImagePyramid Picture(std::uint64_t seed) {
  return BuildPyramid(test::Render(
                          kWidth, kHeight, test::WaveTexture(seed), [](const auto& p) { return p; },
                          2.0, RandomStream(seed)),
                      {});
}

// Squares of `side` blocks; the left `blocked` columns belong to none.
RegionMap Tiles(int side, int blocked = 0) {
  RegionMap map(kWidth, kHeight);
  for (int row = 0; row < map.rows(); ++row) {
    for (int column = blocked; column < map.columns(); ++column) {
      map.At(column, row) = (row / side) * (map.columns() / side + 1) + column / side;
    }
  }
  return map;
}

int Regions(const RegionMap& map) {
  int last = 0;
  for (int row = 0; row < map.rows(); ++row) {
    for (int column = 0; column < map.columns(); ++column) {
      last = std::max(last, map.At(column, row));
    }
  }
  return last + 1;
}

// The definition: the response of the whole image, local maxima, the strongest per region.
std::vector<Corner> Naive(const ImagePyramid& pyramid, const RegionMap& map, int regions,
                          const CornerConfig& config) {
  cv::Mat1f response;
  cv::cornerMinEigenVal(pyramid.image, response, config.window_px, 3);
  const int margin = config.window_px / 2 + 2;
  std::vector<Corner> best(static_cast<std::size_t>(regions));
  for (int y = margin; y < kHeight - margin; ++y) {
    for (int x = margin; x < kWidth - margin; ++x) {
      const int region = map.OfPixel(x, y);
      if (region == RegionMap::kNone) continue;
      const cv::Mat1f around = response(cv::Rect(x - 1, y - 1, 3, 3));
      double most = 0.0;
      cv::minMaxLoc(around, nullptr, &most);
      const double texture = std::sqrt(response(y, x)) * 255.0 / 2.0;
      Corner& corner = best[static_cast<std::size_t>(region)];
      if (response(y, x) < static_cast<float>(most) || texture <= corner.texture) continue;
      corner = {Eigen::Vector2d(x, y), region, texture};
    }
  }
  std::erase_if(best, [&](const Corner& c) { return c.texture <= config.min_texture; });
  return best;
}

TEST(Corners, AgreeWithTheDefinitionOverTheWholeImage) {
  for (const int side : {1, 3, 7}) {
    const ImagePyramid picture = Picture(static_cast<std::uint64_t>(side));
    const RegionMap map = Tiles(side);
    const int regions = Regions(map);
    const std::vector<std::uint8_t> wanted(static_cast<std::size_t>(regions), 1);
    const auto fast = DetectCorners(picture, map, wanted, {});
    auto naive = Naive(picture, map, regions, {});
    ASSERT_EQ(fast.size(), naive.size());
    ASSERT_GT(fast.size(), 20U);
    int same = 0;
    for (std::size_t i = 0; i < fast.size(); ++i) {
      EXPECT_EQ(fast[i].region, naive[i].region);
      EXPECT_NEAR(fast[i].texture, naive[i].texture, 1e-3 * naive[i].texture);
      same += fast[i].pixel == naive[i].pixel
                  ? 1
                  : 0;  // sums round differently, ties may go either way
    }
    EXPECT_GT(same, 0.99 * static_cast<double>(fast.size()));
  }
}

TEST(Corners, LookOnlyWhereTheyAreWanted) {
  const ImagePyramid picture = Picture(1);
  const RegionMap map = Tiles(4, 10);
  std::vector<std::uint8_t> wanted(static_cast<std::size_t>(Regions(map)), 0);
  EXPECT_TRUE(DetectCorners(picture, map, wanted, {}).empty());
  for (std::size_t i = 0; i < wanted.size(); i += 3) wanted[i] = 1;
  const auto corners = DetectCorners(picture, map, wanted, {});
  EXPECT_GT(corners.size(), 10U);
  for (const Corner& corner : corners) {
    EXPECT_EQ(corner.region % 3, 0);
    EXPECT_GE(corner.pixel.x(), 10 * RegionMap::kBlock);
    EXPECT_EQ(map.OfPixel(static_cast<int>(corner.pixel.x()), static_cast<int>(corner.pixel.y())),
              corner.region);
  }
}

double Board(const Eigen::Vector2d& p) {
  return 128.0 + 40.0 * std::tanh((p.x() - 100.2) / 2.0) * std::tanh((p.y() - 80.7) / 2.0);
}

// By the definition, from the function itself: gradients smoothed across like Sobel's, averaged
// over 5 x 5 px.
double BoardTexture(const Eigen::Vector2d& center) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  const auto at = [](const Eigen::Vector2d& p, double dx, double dy) {
    return Board(p + Eigen::Vector2d(dx, dy));
  };
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const Eigen::Vector2d p = center + Eigen::Vector2d(dx, dy);
      Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
      for (int k = -1; k <= 1; ++k) {
        const double weight = k == 0 ? 0.25 : 0.125;
        gradient.x() += weight * (at(p, 1, k) - at(p, -1, k));
        gradient.y() += weight * (at(p, k, 1) - at(p, k, -1));
      }
      sum += gradient * gradient.transpose() / 25.0;
    }
  }
  const double mean = 0.5 * sum.trace();
  return std::sqrt(mean - std::sqrt(mean * mean - sum.determinant()));
}

// The unit of texture at a chessboard corner of known contrast; an edge is no corner.
TEST(Corners, TextureIsInGreyValuesPerPixel) {
  const auto image = test::Render(
      kWidth, kHeight, Board, [](const auto& p) { return p; }, 0.0, RandomStream(1));
  const RegionMap map = Tiles(1000);
  const auto corners =
      DetectCorners(BuildPyramid(image, {}), map, std::vector<std::uint8_t>(1, 1), {});
  ASSERT_EQ(corners.size(), 1U);
  EXPECT_LT((corners[0].pixel - Eigen::Vector2d(100.2, 80.7)).norm(), 1.5);
  EXPECT_NEAR(corners[0].texture, BoardTexture(corners[0].pixel), 0.2);  // grey values are rounded
  const auto edge = [](const Eigen::Vector2d& p) {
    return 128.0 + 80.0 * std::tanh(p.x() - 100.0);
  };
  const auto edges = test::Render(
      kWidth, kHeight, edge, [](const auto& p) { return p; }, 2.0, RandomStream(1));
  EXPECT_TRUE(
      DetectCorners(BuildPyramid(edges, {}), map, std::vector<std::uint8_t>(1, 1), {}).empty());
}

// The end of a bright bar is a corner, its side is none however bright: the one window has a place,
// the other slides along. Shi and Tomasi's measure is above the threshold for both when the side is
// not exactly straight.
TEST(Corners, AreJudgedByTheWindowThatIsFollowed) {
  const auto grey = [](const Eigen::Vector2d& p) {
    const double side =
        0.5 + 0.5 * std::tanh(p.y() - 80.0 - 0.01 * std::pow(p.x() - 160.0, 2.0) / 4.0);
    const double spot = std::exp(-(p - Eigen::Vector2d(60.0, 40.0)).squaredNorm() / 8.0);
    return 20.0 + 220.0 * side + 60.0 * spot;
  };
  const ImagePyramid picture = BuildPyramid(
      test::Render(
          kWidth, kHeight, grey, [](const auto& p) { return p; }, 1.0, RandomStream(1)),
      {});
  std::vector<Corner> corners(3);
  corners[0].pixel = {160.0, 80.0};  // on the side of the bright field
  corners[1].pixel = {60.0, 40.0};   // the spot, of a quarter of its contrast
  corners[2].pixel = {4.0, 40.0};    // no room for a window
  CornerConfig config;
  config.max_position_sigma = 0.8;
  JudgeCorners(picture, config, {}, corners);
  ASSERT_EQ(corners.size(), 1U);
  EXPECT_EQ(corners[0].pixel, Eigen::Vector2d(60.0, 40.0));
  EXPECT_GT(corners[0].position_sigma, 0.0);
  EXPECT_LE(corners[0].position_sigma, 0.8);
}

}  // namespace
}  // namespace mlvi

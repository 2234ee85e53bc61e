// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/map_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mlvi/io/image_encoder.h"

namespace mlvi {
namespace {

constexpr int kMargin = 40;         // px
constexpr double kLargest = 1.0e8;  // cells from the origin; farther points are no map

std::uint64_t Pack(std::int32_t x, std::int32_t y) {
  return (std::uint64_t{static_cast<std::uint32_t>(x)} << 32) | static_cast<std::uint32_t>(y);
}
Eigen::Vector2d Unpack(std::uint64_t key) {
  return {static_cast<std::int32_t>(key >> 32), static_cast<std::int32_t>(key & 0xffffffffU)};
}

// Between the 0.5th and the 99.5th percentile: a few far points must not shrink the rest to a dot.
void InnerRange(std::vector<double>& values, double& low, double& high) {
  const auto tail = static_cast<std::ptrdiff_t>(values.size() / 200);
  std::nth_element(values.begin(), values.begin() + tail, values.end());
  low = std::min(low, *(values.begin() + tail));
  std::nth_element(values.begin(), values.end() - 1 - tail, values.end());
  high = std::max(high, *(values.end() - 1 - tail));
}

// From metres to pixels.
struct View {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
  double pixels_per_metre = 1.0;

  void Fit(int size) {
    const double side = std::max((high - low).maxCoeff(), 1.0);
    pixels_per_metre = (size - 2 * kMargin) / side;
  }
  int Width() const {
    return 2 * kMargin + static_cast<int>(std::ceil((high.x() - low.x()) * pixels_per_metre));
  }
  int Height() const {
    return 2 * kMargin + static_cast<int>(std::ceil((high.y() - low.y()) * pixels_per_metre));
  }
  cv::Point2d ToPixel(const Eigen::Vector2d& p) const {
    return {kMargin + (p.x() - low.x()) * pixels_per_metre,
            kMargin + (high.y() - p.y()) * pixels_per_metre};
  }
};

// The pixels of the cell whose smallest corner is `corner`, m; neighbouring cells abut, and none is
// empty.
cv::Rect CellPixels(const Eigen::Vector2d& corner, double cell, const View& view) {
  const cv::Point2d low = view.ToPixel(corner),
                    high = view.ToPixel(corner + Eigen::Vector2d::Constant(cell));
  const cv::Point left_top(static_cast<int>(std::floor(low.x)),
                           static_cast<int>(std::floor(high.y)));
  const int width = static_cast<int>(std::floor(high.x)) - left_top.x;
  const int height = static_cast<int>(std::floor(low.y)) - left_top.y;
  return {left_top, cv::Size(std::max(width, 1), std::max(height, 1))};
}

// The largest of 1, 2, 5, 10, ... m that takes at most a quarter of the picture.
double ScaleBarLength(const View& view) {
  const double most = 0.25 * view.Width() / view.pixels_per_metre;
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= most) return factor * power;
  }
  return power;
}

void DrawTrajectory(const Trajectory& trajectory, const View& view, cv::Mat& picture) {
  constexpr int kShift = 4;  // fractional bits of OpenCV's drawing functions
  const auto pixel = [&](const StampedPose& pose) {
    const cv::Point2d p = view.ToPixel(pose.pose.translation().head<2>());
    return cv::Point(static_cast<int>(std::lround(p.x * (1 << kShift))),
                     static_cast<int>(std::lround(p.y * (1 << kShift))));
  };
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(trajectory.size());
    const cv::Scalar colour(0, 190 * (1 - share), 40 + 215 * share);
    cv::line(picture, pixel(trajectory[i - 1]), pixel(trajectory[i]), colour, 2, cv::LINE_AA,
             kShift);
  }
}

void DrawScaleBar(const View& view, cv::Mat& picture) {
  const double length = ScaleBarLength(view);
  const cv::Point begin(kMargin / 2, picture.rows - kMargin / 2);
  const cv::Point end(begin.x + static_cast<int>(std::lround(length * view.pixels_per_metre)),
                      begin.y);
  cv::line(picture, begin, end, cv::Scalar::all(0), 3);
  cv::putText(picture, fmt::format("{:g} m", length), begin + cv::Point(0, -8),
              cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(0), 1, cv::LINE_AA);
}

}  // namespace

MapPicture::MapPicture(Trajectory trajectory, double cell)
    : trajectory_(std::move(trajectory)), cell_(cell) {
  MLVI_CHECK(cell > 0.0, "cell {}", cell);
}

void MapPicture::Add(const Eigen::Vector3d& p_world) {
  const double x = std::floor(p_world.x() / cell_), y = std::floor(p_world.y() / cell_);
  if (!(std::abs(x) < kLargest && std::abs(y) < kLargest)) return;
  ++counts_[Pack(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y))];
}

Expected<void> MapPicture::Save(const std::string& path, int size) const {
  MLVI_CHECK(size > 4 * kMargin, "size {}", size);
  View view;
  std::vector<double> xs, ys;
  for (const auto& [key, count] : counts_) {
    const Eigen::Vector2d p = (Unpack(key).array() + 0.5) * cell_;
    xs.push_back(p.x());
    ys.push_back(p.y());
  }
  if (!xs.empty()) InnerRange(xs, view.low.x(), view.high.x());
  if (!ys.empty()) InnerRange(ys, view.low.y(), view.high.y());
  for (const StampedPose& pose : trajectory_) {
    view.low = view.low.cwiseMin(pose.pose.translation().head<2>());
    view.high = view.high.cwiseMax(pose.pose.translation().head<2>());
  }
  if (!view.low.allFinite() || !view.high.allFinite()) {
    return MakeError(ErrorKind::kInput,
                     "no picture '{}': neither points nor poses, or poses that are not finite",
                     path);
  }
  view.Fit(size);
  cv::Mat density(view.Height(), view.Width(), CV_32F, cv::Scalar(0));
  for (const auto& [key, count] : counts_) {
    // Integers below 2^24: the order of the unordered cells does not matter.
    const cv::Rect pixels =
        CellPixels(Unpack(key) * cell_, cell_, view) & cv::Rect(0, 0, density.cols, density.rows);
    if (!pixels.empty())
      density(pixels) += static_cast<double>(count);  // the outermost points lie outside
  }
  Image image{.width = density.cols, .height = density.rows, .channels = 3};
  image.pixels.resize(3 * density.total());
  cv::Mat picture(density.size(), CV_8UC3, image.pixels.data());
  for (int row = 0; row < density.rows; ++row) {
    for (int column = 0; column < density.cols; ++column) {
      const float shade =
          std::min(1.0F, std::log1p(density.at<float>(row, column)) / std::log(40.0F));
      picture.at<cv::Vec3b>(row, column) =
          cv::Vec3b::all(static_cast<std::uint8_t>(255.0F - 215.0F * shade));
    }
  }
  DrawTrajectory(trajectory_, view, picture);
  DrawScaleBar(view, picture);
  return WriteImage(image, path);
}

}  // namespace mlvi

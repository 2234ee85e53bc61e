// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/walking_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr double kStep = 0.05;  // m between samples of the path

template <typename IndexOf>
std::vector<double> Smooth(const std::vector<double>& values, double sigma,
                           const IndexOf& index_of) {
  const auto reach = static_cast<std::int64_t>(std::ceil(4.0 * sigma));
  std::vector<double> kernel;
  double sum = 0.0;
  for (std::int64_t k = -reach; k <= reach; ++k) {
    kernel.push_back(std::exp(-0.5 * static_cast<double>(k * k) / std::max(sigma * sigma, 1e-12)));
    sum += kernel.back();
  }
  std::vector<double> result(values.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::int64_t k = -reach; k <= reach; ++k) {
      result[i] += kernel[static_cast<std::size_t>(k + reach)] / sum *
                   values[index_of(static_cast<std::int64_t>(i) + k)];
    }
  }
  return result;
}

// Points every kStep (or little less) along a closed polyline.
std::vector<Eigen::Vector3d> Resample(const std::vector<Eigen::Vector3d>& corners) {
  const std::size_t n = corners.size();
  double length = 0.0;
  for (std::size_t i = 0; i < n; ++i) length += (corners[(i + 1) % n] - corners[i]).norm();
  const auto count = static_cast<std::size_t>(std::ceil(length / kStep));
  std::vector<Eigen::Vector3d> points;
  std::size_t side = 0;
  double side_begin = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double s = length * static_cast<double>(k) / static_cast<double>(count);
    double side_length = (corners[(side + 1) % n] - corners[side]).norm();
    while (s > side_begin + side_length && side + 1 < n) {
      side_begin += side_length;
      ++side;
      side_length = (corners[(side + 1) % n] - corners[side]).norm();
    }
    const double alpha = (s - side_begin) / side_length;
    points.push_back((1.0 - alpha) * corners[side] + alpha * corners[(side + 1) % n]);
  }
  return points;
}

std::vector<Eigen::Vector3d> SmoothPoints(std::vector<Eigen::Vector3d> points, double sigma) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : points) values.push_back(p[axis]);
    values = SmoothPeriodic(values, sigma);
    for (std::size_t i = 0; i < points.size(); ++i) points[i][axis] = values[i];
  }
  return points;
}

}  // namespace

std::vector<double> SmoothPeriodic(const std::vector<double>& values, double sigma) {
  const auto n = static_cast<std::int64_t>(values.size());
  return Smooth(values, sigma,
                [n](std::int64_t i) { return static_cast<std::size_t>(((i % n) + n) % n); });
}

std::vector<double> SmoothOpen(const std::vector<double>& values, double sigma) {
  const auto last = static_cast<std::int64_t>(values.size()) - 1;
  return Smooth(values, sigma, [last](std::int64_t i) {
    return static_cast<std::size_t>(std::clamp<std::int64_t>(i, 0, last));
  });
}

WalkingPath::WalkingPath(const std::vector<Eigen::Vector3d>& waypoints, double rounding) {
  MLVI_CHECK(waypoints.size() >= 3, "{} waypoints, 3 needed", waypoints.size());
  // Smoothing shortens corners, so the smooth line is sampled again at equal steps.
  const auto points = Resample(SmoothPoints(Resample(waypoints), rounding / kStep));
  const std::size_t n = points.size();
  std::vector<double> headings;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d ahead = points[(i + 1) % n] - points[(i + n - 1) % n];
    length_ += (points[(i + 1) % n] - points[i]).norm();
    double heading = std::atan2(ahead.y(), ahead.x());
    if (i > 0)
      heading = headings.back() + std::remainder(heading - headings.back(), 2.0 * std::numbers::pi);
    headings.push_back(heading);
  }
  turn_ = headings.back() + std::remainder(headings[0] - headings.back(), 2.0 * std::numbers::pi) -
          headings[0];
  const double step = length_ / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double next = i + 1 < n ? headings[i + 1] : headings[0] + turn_;
    const double climb = points[(i + 1) % n].z() - points[(i + n - 1) % n].z();
    samples_.push_back({points[i], headings[i], std::abs(next - headings[i]) / step,
                        std::clamp(0.5 * climb / step, -1.0, 1.0)});
  }
}

PathPoint WalkingPath::At(double s) const {
  const double round = std::floor(s / length_);
  const double position = (s / length_ - round) * static_cast<double>(samples_.size());
  const std::size_t i = std::min(static_cast<std::size_t>(position), samples_.size() - 1);
  const bool last = i + 1 == samples_.size();
  const PathPoint &a = samples_[i], &b = samples_[last ? 0 : i + 1];
  const double alpha = position - static_cast<double>(i);
  const double next_heading = b.heading + (last ? turn_ : 0.0);
  return {.position = (1.0 - alpha) * a.position + alpha * b.position,
          .heading = (1.0 - alpha) * a.heading + alpha * next_heading + round * turn_,
          .curvature = (1.0 - alpha) * a.curvature + alpha * b.curvature,
          .slope = (1.0 - alpha) * a.slope + alpha * b.slope};
}

}  // namespace mlvi

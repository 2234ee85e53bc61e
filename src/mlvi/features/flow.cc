// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/flow.h"

#include <algorithm>
#include <opencv2/video/tracking.hpp>

namespace mlvi {
namespace {

// The way back starts at its goal; a coarse level or two tells whether it stays there.
constexpr int kBackwardLevels = 1;
// OpenCV's minEigThreshold is the smaller eigenvalue of the mean gradient matrix, with gradients of
// 32 per grey value and pixel, scaled by 2^-20 twice.
constexpr double kEigenvaluePerTexture = 32.0 * 32.0 / (1 << 20);

cv::Point2f ToCv(const Eigen::Vector2d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

struct Flow {
  std::vector<cv::Point2f> points;
  std::vector<unsigned char> found;
};

Flow Run(const ImagePyramid& first, const ImagePyramid& second,
         const std::vector<cv::Point2f>& from, const std::vector<cv::Point2f>& guess, int levels,
         const PyramidConfig& pyramid, const FlowConfig& config) {
  Flow flow{.points = guess, .found = {}};
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                              config.max_iterations, config.step_px);
  cv::calcOpticalFlowPyrLK(first.levels, second.levels, from, flow.points, flow.found,
                           cv::noArray(), {pyramid.window_px, pyramid.window_px}, levels, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW,
                           config.min_texture * config.min_texture * kEigenvaluePerTexture);
  return flow;
}

bool Inside(const ImagePyramid& pyramid, const cv::Point2f& p) {
  return p.x >= 0.0F && p.y >= 0.0F && p.x <= static_cast<float>(pyramid.width() - 1) &&
         p.y <= static_cast<float>(pyramid.height() - 1);
}

}  // namespace

void FlowConfig::Declare(ConfigDeclaration& d) {
  d.Field("max_iterations", max_iterations, "", "Steps per pyramid level", {1.0, 100.0});
  d.Field("step_px", step_px, "px", "A shorter step ends the search on a level", {1e-4, 1.0});
  d.Field("max_round_trip_px", max_round_trip_px, "px",
          "Farthest that tracking forward and back may end from its start", {0.01, 10.0});
  d.Field("min_texture", min_texture, "1/px",
          "Grey values per pixel, root mean square over the window along its weakest direction",
          {0.0, 255.0});
}

std::vector<FlowResult> TrackFlow(const ImagePyramid& first, const ImagePyramid& second,
                                  std::span<const FlowRequest> requests,
                                  const PyramidConfig& pyramid, const FlowConfig& config) {
  MLVI_CHECK(first.width() == second.width() && first.height() == second.height(),
             "images of {} x {} and {} x {} px", first.width(), first.height(), second.width(),
             second.height());
  std::vector<FlowResult> results(requests.size());
  if (requests.empty()) return results;
  std::vector<cv::Point2f> from, guess;
  for (const FlowRequest& request : requests) {
    from.push_back(ToCv(request.from));
    guess.push_back(ToCv(request.predicted));
  }
  const Flow there = Run(first, second, from, guess, pyramid.levels, pyramid, config);
  const Flow back = Run(second, first, there.points, from,
                        std::min(kBackwardLevels, pyramid.levels), pyramid, config);
  for (std::size_t i = 0; i < results.size(); ++i) {
    FlowResult& result = results[i];
    if (!there.found[i] || !back.found[i] || !Inside(second, there.points[i])) continue;
    result.pixel = {there.points[i].x, there.points[i].y};
    result.round_trip_px = std::hypot(back.points[i].x - from[i].x, back.points[i].y - from[i].y);
    result.status = result.round_trip_px <= config.max_round_trip_px ? FlowStatus::kTracked
                                                                     : FlowStatus::kRoundTrip;
  }
  return results;
}

}  // namespace mlvi

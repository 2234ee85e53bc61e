// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Optical flow of single points between two images of one camera: pyramidal Kanade-Lucas-Tomasi
// (Bouguet's form, by OpenCV) from a predicted place, with a forward-backward check.
//
// Points are independent of one another, so results have the same bits at any number of threads,
// OpenCV's own included. This library never calls cv::setNumThreads, which is state of the whole
// process. Debian's OpenCV runs on oneTBB and so under ThreadLimit; of a build with threads of its
// own, its user decides.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/features/image_pyramid.h"

namespace mlvi {

struct FlowConfig {
  int max_iterations = 30;
  double step_px = 0.01;
  double max_round_trip_px = 0.5;
  double min_texture = 1.0;
  void Declare(ConfigDeclaration& d);
};

struct FlowRequest {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();       // px, in the first image
  Eigen::Vector2d predicted = Eigen::Vector2d::Zero();  // px, in the second one
};

enum class FlowStatus : int {
  kTracked = 0,
  kLost = 1,       // no texture, or left the image
  kRoundTrip = 2,  // the way back ends elsewhere: occlusion, repetition, blur
};

struct FlowResult {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the second image
  FlowStatus status = FlowStatus::kLost;
  double round_trip_px = 0.0;  // distance between `from` and where the way back ends
};

// One result per request, in order. Both pyramids are made with one PyramidConfig.
std::vector<FlowResult> TrackFlow(const ImagePyramid& first, const ImagePyramid& second,
                                  std::span<const FlowRequest> requests,
                                  const PyramidConfig& pyramid, const FlowConfig& config);

}  // namespace mlvi

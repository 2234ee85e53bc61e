// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Outliers among the tracks of all cameras at once: one RANSAC for the sphere. The gyroscope knows
// the rotation between two frames, so the relative pose of the generalised camera has three
// unknowns, the translation. With x_a = R x_b + t and rays (C_a, f_a), (C_b, f_b), the baseline of
// a pair is c = t + R C_b - C_a and both rays meet when
//
//   (f_a x R f_b) . c = 0,
//
// linear in t. Two pairs give t up to a motion along one line; its length is what only the offsets
// of the cameras tell, often weakly. So it is hypothesised from a third pair, from the predicted
// translation, and from a nominal one, and refined on all inliers, where it stays put when they do
// not tell it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/geometry/pose3.h"
#include "mlvi/geometry/triangulation.h"

namespace mlvi {

// The rays of one track at two instants, each in the pano frame of its own instant.
struct RayPair {
  Ray first, second;
};

struct RelativeTranslationConfig {
  double inlier_sigmas = 3.0;
  double least_sigmas = 1.0;
  double scatter_factor = 4.0;
  double min_depth = 0.2;
  double nominal_translation = 0.1;
  double max_translation = 2.0;
  double confidence = 0.999;
  int max_iterations = 200;
  int seed = 1;
  void Declare(ConfigDeclaration& d);
};

struct RelativeTranslation {
  Eigen::Vector3d t_first_second =
      Eigen::Vector3d::Zero();  // m, of the second pano frame in the first
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // 1/m^2, of the inliers
  std::vector<std::uint8_t> inliers;                      // one flag per pair
  int inlier_count = 0;
  double score =
      0.0;  // MSAC: sum over pairs of min(error^2, inlier_sigmas^2), less a bonus for rest
  int iterations = 0;
};

// Squared error, in sigmas, of a pair under a relative pose: how far bearings have to be turned for
// the rays to meet, in front of both cameras and not nearer than `min_depth`. Without a baseline
// rays have to be parallel. Two-sided: pairs meet the epipolar plane (first order, Sampson) and the
// range of parallax that depths in [min_depth, infinity) allow.
double SquaredPairError(const RayPair& pair, const Eigen::Matrix3d& R_first_second,
                        const Eigen::Vector3d& t_first_second, double min_depth);

// MSAC with local refinement; the same bits for the same input. `predicted`: translation expected
// by the IMU, if any.
RelativeTranslation EstimateRelativeTranslation(std::span<const RayPair> pairs,
                                                const Eigen::Quaterniond& R_first_second,
                                                const std::optional<Eigen::Vector3d>& predicted,
                                                const RelativeTranslationConfig& config);

}  // namespace mlvi

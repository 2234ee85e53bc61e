// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Depth of visual features from LiDAR points (Multi-LVI-SAM, "Feature depth association"), with the
// exact ray of the camera instead of the sphere's, a plane through all points around it instead of
// three of them, and a variance, because a depth from noisy points is a measurement.
#pragma once

#include <Eigen/Core>

#include "mlvi/geometry/triangulation.h"
#include "mlvi/vio/depth_map.h"

namespace mlvi {

enum class DepthStatus : int {
  kFound = 0,
  kNoPoints = 1,    // too few points near the ray, or the ray passes before all of them
  kSpread = 2,      // points off the plane: an occlusion edge, or blur of accumulation
  kForeground = 3,  // something stands before the plane, beside the ray or on its way
  kGrazing = 4,     // the ray runs along the plane
  kOutOfRange = 5,  // depths below config.min_depth or beyond max_depth
  kUncertain = 6,   // the points do not tell well enough how the plane lies
};

struct FeatureDepth {
  DepthStatus status = DepthStatus::kNoPoints;
  double depth = 0.0;     // m, along the ray from its origin
  double variance = 0.0;  // m^2: of the plane, roughness, directions of beams, bearing noise
};

// Where a feature's ray (pano frame, from the camera centre C_i, unit direction, sigma of the
// bearing) meets the plane through the points around it: the nearest surface on the ray, as far as
// S sees it (FirstSurface). Neighbours are sought around the direction from S to the point found,
// so that the camera's offset shifts nothing: a few rounds.
FeatureDepth AssociateDepth(const SphericalDepthMap& map, const Ray& ray,
                            const DepthConfig& config);

}  // namespace mlvi

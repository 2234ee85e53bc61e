// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Where on a camera's ray the nearest surface is, as far as LiDAR points seen from the centre of
// the sphere tell.
#pragma once

#include <optional>

#include "mlvi/geometry/triangulation.h"
#include "mlvi/vio/depth_map.h"

namespace mlvi {

// rad; what a tracker's window of 13 px covers around its middle, for usual lenses: a feature is
// likely to be on the edge of what stands out there.
inline constexpr double kWindowReach = 0.02;

// The depth (m, along the ray) at which a ray (pano frame, from the camera centre C_i) first comes
// to lie behind a point of the map, walked from near to far; empty when it never does.
//
// Seen from S a ray is an arc of a great circle, from the direction of the camera to that of the
// ray: at the angle phi from the ray its point is at the range |C_perp| / sin(phi), with C_perp
// what of C_i is normal to the ray. Steps are even in phi, one cell each. A surface that stands
// before another one hides it, however far from it the two are seen from S.
std::optional<double> FirstSurface(const SphericalDepthMap& map, const Ray& ray,
                                   const DepthConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What is done about the offset between the centre C_i of a camera and the centre S of the sphere.
// Multi-LVI-SAM, section III-B, Eq. (3)-(8); measured in docs/compensation.md.
//
//   none   rays start at S: the uncompensated panorama. Exact at depth r only.
//   plane  the paper's method. Triangulation from S, corrected within the planes through S, C and u
//          (Eq. 3-8).
//   ray    the generalised camera: every ray starts at its camera centre. Exact.
//
// The paper compensates triangulation. What follows for residuals: `none` places the point on S_a
// u_a and compares directions from S_j; `plane` places it on C_a u_a, as Eq. (7) does, and compares
// only normal to plane (S_j, C_j, u_j), which is the exact constraint of Eq. (8); `ray` uses the
// exact rays at both ends.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "mlvi/geometry/triangulation.h"
#include "mlvi/panorama/panorama_model.h"

namespace mlvi {

enum class Compensation : int { kNone = 0, kPlane = 1, kRay = 2 };

// An observation of a point by a rig at a known pose; `pixel_sigma` is one sigma of the pixel, per
// axis.
struct PanoramicView {
  PanoramicObservation observation;
  Pose3 T_world_pano;
  double pixel_sigma = 1.0;
};

// The ray of an observation, world frame: S u_s for kNone and kPlane, C u for kRay.
Ray WorldRay(const PanoramicView& view, Compensation mode);

// The point seen by two views, in world; midpoint of the two rays, corrected by Eq. (3)-(7) for
// kPlane. Empty when the rays are parallel or meet behind an origin.
std::optional<Eigen::Vector3d> TriangulateTwoViews(const PanoramicView& a, const PanoramicView& b,
                                                   Compensation mode);

// The point seen by two or more views, in world. kNone, kRay: maximum likelihood over the rays.
// kPlane: Eq. (8), least squares over the planes; needs three planes in general position. Empty
// when there is no such point.
std::optional<TriangulatedPoint> TriangulateViews(std::span<const PanoramicView> views,
                                                  Compensation mode);

}  // namespace mlvi

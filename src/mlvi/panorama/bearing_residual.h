// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The residual of one observation of a feature that is anchored in another: pure geometry with all
// its Jacobians, which a factor only has to hand on. Modes of compensation differ in the rays, not
// in the residual.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "mlvi/panorama/compensation.h"

namespace mlvi {

// Where a ray starts and points, pano frame, as a function of the camera's place T_pano_camera.
struct PanoramicRay {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();      // m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  // unit
  // Maps differences of unit directions at `direction` to pixels; constant, so that changes of
  // extrinsics leave it.
  Eigen::Matrix<double, 2, 3> weight = Eigen::Matrix<double, 2, 3>::Zero();
  int freedom = 2;  // rank of `weight`: of so many directions a residual tells
  // Derivatives by the pose chart of T_pano_camera (BoxPlus: translation, rotation).
  Eigen::Matrix<double, 3, 6> d_origin = Eigen::Matrix<double, 3, 6>::Zero();
  Eigen::Matrix<double, 3, 6> d_direction = Eigen::Matrix<double, 3, 6>::Zero();
};

enum class RayRole : int {
  kAnchor = 0,  // carries the feature at a depth along it
  kTarget = 1,  // is compared with
};

// The ray of an observation for a camera at `T_pano_camera` (nominally the place it was lifted
// with) on a sphere of `radius` m: compensation.h says which ray a mode takes in which role.
PanoramicRay MakePanoramicRay(const PanoramicObservation& observation, const Pose3& T_pano_camera,
                              double radius, Compensation mode, RayRole role);

struct BearingGeometry {
  Pose3 T_world_anchor;  // body poses at the two instants
  Pose3 T_world_target;
  Pose3 T_body_pano;
};

// Derivatives of a residual (px); poses in the chart of BoxPlus(Pose3, Vector6d).
struct BearingJacobians {
  using Block = Eigen::Matrix<double, 2, 6>;
  Block anchor, target, body_pano;     // T_world_anchor, T_world_target, T_body_pano
  Block anchor_camera, target_camera;  // T_pano_camera of the cameras of the two rays
  Eigen::Vector2d inverse_depth;       // px m
};

// residual = W (v / |v| - d_target) in px, with v the feature at inverse depth rho (1/m, >= 0)
// along the anchor's ray, seen from the target's origin, times rho: points at infinity (rho = 0)
// are as good as others. Empty when the feature lies at the target's origin (within 1e-6 of its
// depth): no direction, no residual. A feature more than 90 degrees away from the observation has a
// residual like one nearer: check dot products where outliers are possible.
std::optional<Eigen::Vector2d> BearingResidual(const PanoramicRay& anchor, double inverse_depth,
                                               const PanoramicRay& target,
                                               const BearingGeometry& geometry,
                                               BearingJacobians* jacobians = nullptr);

}  // namespace mlvi

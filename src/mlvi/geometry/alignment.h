// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The transform that best maps one set of points onto another, in closed form: Umeyama,
// "Least-squares estimation of transformation parameters between two point patterns" (TPAMI 1991);
// for yaw alone Zhang and Scaramuzza, "A tutorial on quantitative trajectory evaluation for
// visual(-inertial) odometry" (IROS 2018).
#pragma once

#include <Eigen/Core>
#include <span>

#include "mlvi/base/error.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

enum class AlignmentKind : int {
  kNone = 0,  // identity
  kSe3 = 1,   // rotation and translation
  kSim3 = 2,  // and scale
  kYaw = 3,   // rotation about z and translation: what gravity leaves free
};

// p_target = scale * R * p_source + t.
struct Similarity3 {
  double scale = 1.0;
  Pose3 pose;  // R, t

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return pose * (scale * point); }
  // A pose T_source_x as T_target_x: its position is mapped, its rotation turned.
  Pose3 operator*(const Pose3& other) const {
    return pose * Pose3(other.rotation(), scale * other.translation());
  }
};

// Minimises sum_i w_i |target_i - S source_i|^2. `weights`: empty (all 1) or one per point, >= 0.
// Contract: equal numbers. Errors (kInput), with the numbers: no points; points that leave the
// rotation or the scale open (all in one place, on one line for kSe3 and kSim3, above one another
// for kYaw).
Expected<Similarity3> AlignPoints(std::span<const Eigen::Vector3d> source,
                                  std::span<const Eigen::Vector3d> target, AlignmentKind kind,
                                  std::span<const double> weights = {});

}  // namespace mlvi

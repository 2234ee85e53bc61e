// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Which pose of an estimate belongs to which pose of the truth. Poses are compared as matrices just
// as they were given: the rotations of some truth files (KITTI: seven digits) are not orthonormal
// beyond 1e-7, and other tools do not repair them either, so figures agree with theirs to the last
// digits.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/time.h"
#include "mlvi/geometry/stamped_pose.h"

namespace mlvi {

enum class AssociationKind : int {
  // The denser trajectory is interpolated at the stamps of the sparser one: no error of time
  // enters.
  kInterpolate = 0,
  // Each pose of the sparser trajectory with the nearest in time of the denser one (as evo does by
  // default).
  kNearest = 1,
};

struct AssociationOptions {
  AssociationKind kind = AssociationKind::kInterpolate;
  double max_difference = 0.01;  // s; largest difference in time of a pair (kNearest)
  double max_gap =
      0.25;  // s; longest interval that is interpolated, except within max_difference of a pose
  Duration estimate_offset{};  // added to the stamps of the estimate
};

using PoseMatrices = std::vector<Eigen::Isometry3d>;

struct MatchedPoses {
  std::vector<Time>
      stamps{};  // of the trajectory that was matched against the other; empty for unstamped poses
  PoseMatrices estimate{};
  PoseMatrices truth{};
  bool has_rotations = true;       // false: a pose of either side knows its position only
  std::size_t estimate_count = 0;  // poses given
  std::size_t truth_count = 0;
};

// Stamps need not be sorted. Errors (kInput): an empty trajectory or a value that is not finite; no
// overlap in time, with both ranges and the likely cause; no pair within the limits. So a result
// holds at least one pair.
Expected<MatchedPoses> Associate(const Trajectory& estimate, const Trajectory& truth,
                                 const AssociationOptions& options);

// Pose i with pose i, for files without stamps. Errors (kInput): none, or different numbers.
Expected<MatchedPoses> AssociateByIndex(const PoseMatrices& estimate, const PoseMatrices& truth);

}  // namespace mlvi

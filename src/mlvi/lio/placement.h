// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a new start belongs in the world of what was before: position and heading go on from where
// the odometry lost track, roll and pitch come from gravity.
#pragma once

#include "mlvi/lio/filter_state.h"
#include "mlvi/lio/lio_config.h"

namespace mlvi {

// The body's pose at the end of the first sweep of the new start, as far as it is known.
struct Placement {
  Pose3 T_world_body;
  Matrix6d
      covariance;  // of the motion since the last estimate; chart: world position, body rotation
};

// After a time without IMU of more than config.gap.max_silence a prediction means nothing: `last`
// is where the body was last seen, and it may have gone on at config.start.max_speed into any
// direction and turned by any angle. Else that of `prediction`. `silent` and `unwatched` are the
// seconds without IMU and since the last estimate.
Placement PlaceOf(const StateEstimate& last, const StateEstimate& prediction, double silent,
                  double unwatched, const LioConfig& config);

// The turn about the vertical and the shift T_world_level that put the body, at `T_level_body` in
// the level world of the new start, at `place`. The heading is that which brings the attitudes
// closest to each other.
Pose3 WorldOfStart(const Pose3& T_level_body, const Pose3& place);

// What is unknown about the place of a new start, seen at the pose `T_world_body` of one of its
// states: of the covariance of `placement` position and heading; roll and pitch are the start's
// own.
Matrix6d PlacementError(const Placement& placement, const Pose3& T_world_body);

}  // namespace mlvi

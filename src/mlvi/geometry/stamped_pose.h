// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// A pose at an instant. Which frames it relates is said where it is used; in a trajectory file it
// is T_world_body.
struct StampedPose {
  Time stamp;
  Pose3 pose;
  bool has_rotation = true;  // false: only the position was measured, the rotation here is identity
};

// Usually in the order of the stamps; who needs it sorts.
using Trajectory = std::vector<StampedPose>;

}  // namespace mlvi

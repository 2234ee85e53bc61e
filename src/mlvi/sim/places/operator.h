// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Who carries a handheld rig: a person close behind it, whose trunk hides a part of what a LiDAR
// would see and whose arms hold it up.
#pragma once

#include "mlvi/base/random.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sim/world.h"

namespace mlvi {

struct Carrying {
  double distance = 0.42;  // m, horizontally from the body of the rig to the middle of the trunk
  double handle = 0.22;    // m, from the body of the rig down to the hands
  double height = 1.4;     // m, of the rig over the ground where none is found (kHandheldHeight)
};

// The person behind the rig that moves on `motion` (T_world_body), whose instants count from its
// begin; `R_carrier_body` as of MakeWalk. Trunk, head and legs follow the smoothed motion, 0.3 s
// behind and ahead, and sway with the steps; the hands are at the handle at every instant. Build
// and clothes are drawn. The person stands on what is below within 0.35 m of that height.
MovingObject MakeOperator(const World& world, const PoseSpline& motion,
                          const Eigen::Quaterniond& R_carrier_body, const Carrying& carrying,
                          RandomStream random);

}  // namespace mlvi

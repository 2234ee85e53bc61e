// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// A sweep as if all its points had been measured at one instant.
struct DeskewedSweep {
  Time stamp;                        // that instant: the last firing
  PointCloud points;                 // body frame at `stamp`, range limits of the LiDAR applied
  std::vector<std::size_t> sources;  // index of each point in the sweep
};

// Moves every point from the pose of the body at its own firing to that at sweep.end():
//   p = T_world_body(end)^-1 T_world_body(t) T_body_lidar p_lidar.
// `trajectory` holds states in ascending order, not empty, in any fixed frame; outside its span the
// nearest pose is held. Sweeps without times are taken as instantaneous. Poses are tabulated every
// millisecond and interpolated linearly: at 10 rad/s the chord error is (w dt)^2 / 8 = 1.3e-5 rad.
DeskewedSweep Deskew(const LidarSweep& sweep, std::span<const NavState> trajectory,
                     const LidarSpec& lidar);

}  // namespace mlvi

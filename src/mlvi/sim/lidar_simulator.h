// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/spline.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sim/lidar_echoes.h"
#include "mlvi/sim/lidar_pattern.h"
#include "mlvi/sim/world.h"

namespace mlvi {

// A sweep and the truth about it: `returns[i]` is what came back to the i-th ray, before errors of
// range, detected or not.
struct TracedSweep {
  LidarSweep sweep;
  std::vector<LidarReturn> returns;
};

// Sweeps of a moving LiDAR: every ray starts from the pose of the body at its own firing instant,
// and meets moving objects where they are then, to 0.1 ms.
class LidarSimulator {
 public:
  LidarSimulator(LidarPattern pattern, const Pose3& T_body_lidar, RandomStream random)
      : pattern_(std::move(pattern)), T_body_lidar_(T_body_lidar), random_(random) {}

  const LidarPattern& pattern() const { return pattern_; }

  // The sweep that starts at `stamp`; `motion` must cover [stamp, stamp + span]. Holds one point
  // per ray in message order, zero where nothing came back. The noise depends on `index` alone, not
  // on earlier calls or threads.
  LidarSweep Sweep(const World& world, const PoseSpline& motion, Time stamp,
                   std::uint64_t index) const {
    return Trace(world, motion, stamp, index).sweep;
  }
  TracedSweep Trace(const World& world, const PoseSpline& motion, Time stamp,
                    std::uint64_t index) const;

 private:
  // The world at one instant of a sweep.
  struct Scenery {
    WorldSnapshot world;
    std::vector<WorldSnapshot::Obstacle> moving;
  };
  std::vector<Scenery> SceneryOf(const World& world, const PoseSpline& motion, Time stamp) const;
  struct Shot;  // a pulse with its errors
  Shot Aim(const LidarRay& ray, const Scenery& scenery, const WorldSnapshot& still,
           const Pose3& T_world_lidar, RandomStream random) const;
  LidarPoint Measure(const LidarRay& ray, const Shot& shot,
                     const std::optional<LidarReturn>& echo) const;

  LidarPattern pattern_;
  Pose3 T_body_lidar_;
  RandomStream random_;
};

// Keeps finite points from `min_range` (> 0) to `max_range` m only and counts offsets from the
// first firing among them, as a sweep read from a file is delivered (LidarSweep). A sweep without
// any keeps its stamp.
void KeepReturns(LidarSweep& sweep, double min_range, double max_range);

}  // namespace mlvi

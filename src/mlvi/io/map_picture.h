// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <unordered_map>

#include "mlvi/base/error.h"
#include "mlvi/geometry/stamped_pose.h"

namespace mlvi {

// A map and a trajectory seen from above (x right, y up) as a PNG picture: darker where more points
// are, the trajectory as a line from green (start) to red (end), a scale bar. Points are counted in
// cells as they come; memory grows with the mapped area only.
class MapPicture {
 public:
  // `trajectory` in the frame of the points. `cell` is the resolution of counting, m.
  explicit MapPicture(Trajectory trajectory, double cell = 0.1);

  void Add(const Eigen::Vector3d& p_world);
  // The longer side of the picture has `size` pixels. The picture shows the trajectory and all but
  // the outermost points. Errors: nothing to show (kInput), the file cannot be written
  // (CannotWrite).
  Expected<void> Save(const std::string& path, int size = 1600) const;

 private:
  Trajectory trajectory_;
  double cell_;
  std::unordered_map<std::uint64_t, std::uint32_t> counts_;  // by packed cell indices
};

}  // namespace mlvi

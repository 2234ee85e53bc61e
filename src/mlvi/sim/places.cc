// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places.h"

namespace mlvi {

WalkingPath WalkAt(double height, std::vector<Eigen::Vector3d> waypoints, double rounding) {
  for (Eigen::Vector3d& point : waypoints) point.z() += height;
  return WalkingPath(waypoints, rounding);
}

}  // namespace mlvi

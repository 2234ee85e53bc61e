// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "mlvi/base/random.h"

namespace mlvi {

// A unit vector, all directions alike.
inline Eigen::Vector3d RandomDirection(RandomStream& random) {
  const double x = random.Normal(), y = random.Normal(), z = random.Normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

}  // namespace mlvi

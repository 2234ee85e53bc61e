// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace mlvi {

// A box along the axes of a frame: a bound of things, tighter than a ball around limbs and boards.
struct RayBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  // sides

  // Whether the ray from `origin` along `direction` (of any length) meets it: false only where it
  // does not. Separating axes of a line and a box, without divisions.
  bool MayBeMet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    const Eigen::Vector3d o = origin - centre, &d = direction;
    const auto apart = [&](int i, int j) {
      return std::abs(o[i] * d[j] - o[j] * d[i]) >
             half[i] * std::abs(d[j]) + half[j] * std::abs(d[i]);
    };
    if (apart(0, 1) || apart(0, 2) || apart(1, 2)) return false;
    const auto behind = [&](int i) { return std::abs(o[i]) > half[i] && o[i] * d[i] >= 0.0; };
    return !(behind(0) || behind(1) || behind(2));
  }
};

}  // namespace mlvi

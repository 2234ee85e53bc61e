// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace mlvi {

// argmin g^T H g / 2 - c^T g on the sphere |g| = radius > 0, for symmetric H: g = (H + lambda I)^-1
// c with the one lambda above minus the smallest eigenvalue of H that gives the radius (the secular
// equation). Gravity, whose length is known, is estimated so.
Eigen::Vector3d MinimizeOnSphere(const Eigen::Matrix3d& H, const Eigen::Vector3d& c, double radius);

}  // namespace mlvi

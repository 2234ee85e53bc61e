// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// SO(3) and its derivatives. Right perturbation throughout: R boxplus d = R Exp(d). Rotations are
// unit quaternions; tangent vectors are 3-vectors in radians. References: Sola, Deray, Atchuthan,
// "A micro Lie theory" (2018); Forster et al., "On-Manifold Preintegration" (2017).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mlvi {

// The skew-symmetric matrix with Hat(a) b = a x b.
inline Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0)
      .finished();
}

// Exact for every angle, also beyond pi; accurate near zero.
Eigen::Quaterniond ExpSo3(const Eigen::Vector3d& omega);
// In the ball of radius pi; at pi either of the two values.
Eigen::Vector3d LogSo3(const Eigen::Quaterniond& rotation);

// Exp(w + d) = Exp(w) Exp(Jr(w) d) to first order.
Eigen::Matrix3d RightJacobianSo3(const Eigen::Vector3d& omega);
// Log(Exp(w) Exp(d)) = w + Jr^-1(w) d to first order. |w| < 2 pi.
Eigen::Matrix3d RightJacobianInverseSo3(const Eigen::Vector3d& omega);

// The geodesic from a (0) to b (1).
Eigen::Quaterniond InterpolateSo3(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b,
                                  double alpha);

}  // namespace mlvi

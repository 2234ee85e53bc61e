// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/lio/association.h"
#include "mlvi/lio/deskew_error.h"

namespace mlvi {

// The normal equations of all correspondences at one pose, in the chart (world position, body
// rotation):
//   J(d) = 1/2 sum w_i (z_i + h_i d)^2,  A = sum w h h^T,  b = sum w h z.
struct PoseNormalEquations {
  Matrix6d A = Matrix6d::Zero();
  SweepParts parts;  // of A: what the parts of the sweep tell, by lag
  Vector6d b = Vector6d::Zero();
  Matrix6d feigned = Matrix6d::Zero();           // the part of A that noisy normals feign
  double weighted_squares = 0.0, weights = 0.0;  // of residuals in m, by robust weight
  double chi_square = 0.0;                       // of residuals in sigmas, by robust weight
  int inliers = 0;
  PoseNormalEquations& operator+=(const PoseNormalEquations& other);
};
PoseNormalEquations Linearize(const std::vector<Correspondence>& correspondences,
                              const Pose3& T_world_body, const RegistrationConfig& config);

// How large the noise is beside what the constraints claim, by their residuals at one pose: the
// median of |z| / sigma over that of a standard normal variable. Up to half of them may be
// outliers. 1 without constraints.
double NoiseScale(const std::vector<Correspondence>& correspondences, const Pose3& T_world_body);

// Adds `D`, the covariance of an error that all constraints share, to that of their solution, which
// stays where it is: A <- (I + A D)^-1 A, b <- (I + A D)^-1 b. A may be singular.
void AddCommonError(const Matrix6d& D, Matrix6d& A, Vector6d& b);

}  // namespace mlvi

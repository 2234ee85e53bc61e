// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/lio/association.h"
#include "mlvi/lio/degeneracy.h"
#include "mlvi/lio/filter_state.h"

namespace mlvi {

struct RegistrationResult {
  StateEstimate estimate;
  Degeneracy degeneracy;
  std::optional<Eigen::Vector3d> lone_axis;  // for the next sweep (FindDegeneracy)
  int correspondences = 0;                   // at the end, robust weight above one half
  int offered = 0;                           // feature points
  int iterations = 0;
  double rms_residual = 0.0;  // m, robustly weighted
  bool converged = false;
};

// The MAP estimate of the state under the Gaussian `prior` and point-to-plane and point-to-line
// residuals against the map, by Gauss-Newton with renewed associations (the iterated error-state
// filter of FAST-LIO2 in a form that inverts neither the prior covariance nor the measurement
// information, both of which may be singular). Along directions that most constraints only feign to
// tell, those few count whose surfaces face along them and the marks along `last_axis`, if they
// suffice; else the prior decides.
// What has not converged after max_iterations is known no better than its last step but one.
// `last_axis` is the lone axis of the previous sweep (FindDegeneracy).
RegistrationResult Register(const SweepFeatures& features, const LocalMap& map,
                            const StateEstimate& prior, const LidarSpec& lidar,
                            const std::optional<Eigen::Vector3d>& last_axis,
                            const RegistrationConfig& config, const DegeneracyConfig& degeneracy);

}  // namespace mlvi

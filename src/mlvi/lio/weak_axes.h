// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "mlvi/lio/degeneracy.h"
#include "mlvi/lio/normal_equations.h"

namespace mlvi {

// Takes out of the normal equations `sums` of `correspondences` what noisy normals feign along the
// weak directions. Surfaces that face along a weak translation stay in whole when they tell it well
// enough by themselves (the far end of a corridor), and `marks` come in when they do (the jambs of
// its doors). Such a direction is struck from the degenerate ones; along the others nothing
// remains, and the prior decides.
void LeaveOutFeigned(const std::vector<Correspondence>& correspondences,
                     const std::vector<Correspondence>& marks, const Pose3& T_world_body,
                     const RegistrationConfig& config, const DegeneracyConfig& degeneracy,
                     PoseNormalEquations& sums, DegenerateDirections& directions);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Estimates seen from another fixed frame. The odometry runs in a frame of its own, which drifts
// against the world and never jumps; what leaves the system is in the world (docs/decisions.md).
#pragma once

#include "mlvi/state/estimates.h"

namespace mlvi {

// `state`, given in frame `old`, in frame `new`.
NavState InFrame(const Pose3& T_new_old, const NavState& state);

// The same of a whole estimate: covariance and degenerate axes turn along. That `T_new_old` is not
// exactly known counts for nothing.
OdometryEstimate InFrame(const Pose3& T_new_old, const OdometryEstimate& estimate);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sensors/rig.h"
#include "mlvi/vio/window.h"

namespace mlvi {

// The rig with mounts and time offsets of its cameras as estimated. Contract: `calibration` is of
// this rig's cameras.
Rig CalibratedRig(Rig rig, const VioCalibration& calibration);

}  // namespace mlvi

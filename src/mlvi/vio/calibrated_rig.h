// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "mlvi/sensors/rig.h"
#include "mlvi/vio/window.h"

namespace mlvi {

// The rig with mounts and time offsets of its cameras as estimated; `names` are the cameras that
// `calibration` is of, others stay as they are.
Rig CalibratedRig(Rig rig, std::span<const std::string> names, const VioCalibration& calibration);

}  // namespace mlvi

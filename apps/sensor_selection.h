// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/rig.h"

std::vector<std::string> SplitAtCommas(const std::string& list);

// The sensors of `rig` that a run uses. `cameras`: "all", "none", or names separated by commas.
// Errors (kConfiguration): a name that the rig does not have or that is given twice, no LiDAR where
// none is left out, nothing left to see with.
mlvi::Expected<mlvi::Rig> SelectSensors(const mlvi::Rig& rig, const std::string& cameras,
                                        bool no_lidar);

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/base/error.h"
#include "mlvi/sim/recording.h"

// Writes a picture of what all cameras of the recording see around the instant at `share` (0 to 1)
// of its length, two in a row, with the returns of the LiDAR's sweep at that time drawn in,
// coloured by distance (red 1 m, blue 40 m): on the same edges, if rig and simulation are sound.
// The lower half repeats the images without the points.
mlvi::Expected<void> WriteContactSheet(const mlvi::Recording& recording, double share,
                                       const std::string& path);

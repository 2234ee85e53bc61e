// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/base/error.h"
#include "mlvi/geometry/stamped_pose.h"

namespace mlvi {

// TUM trajectories: lines of `t x y z qx qy qz qw`, blanks or commas between, '#' for comments.
// Stamps in seconds are read to the nanosecond. A zero quaternion (M2DGR's Leica files) means
// position only: has_rotation is false. Errors (kInput) give file and line: not 8 numbers, not
// finite, a quaternion whose norm is neither 0 nor within 1 % of 1; no pose at all.
Expected<Trajectory> ReadTum(const std::string& path);
Expected<Trajectory> ParseTum(const std::string& text, const std::string& origin);

// Writes with nine decimals of seconds and enough digits for a micrometre and 1e-9 of rotation.
// `comment` becomes the first line ("# ..."): say which frame and which instant the poses refer to.
Expected<void> WriteTum(const Trajectory& trajectory, const std::string& path,
                        const std::string& comment = "");
// One line, with its end.
std::string TumLine(const StampedPose& pose);

}  // namespace mlvi

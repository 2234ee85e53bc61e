// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/base/error.h"
#include "mlvi/eval/association.h"
#include "mlvi/geometry/stamped_pose.h"

// What a trajectory file holds: either stamped poses or bare ones.
struct PoseFile {
  mlvi::Trajectory stamped;
  mlvi::PoseMatrices unstamped;
  bool has_stamps() const { return unstamped.empty(); }
};

// Reads a trajectory, telling the format by its first row:
//   TUM     t x y z qx qy qz qw                     seconds
//   EuRoC   t, x, y, z, qw, qx, qy, qz[, ...]       integer nanoseconds (state_groundtruth_estimate0/data.csv)
//   KITTI   12 numbers, a 3x4 matrix row by row     no stamps
// Errors (kInput) name file, line and what was expected.
mlvi::Expected<PoseFile> ReadPoseFile(const std::string& path);

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <map>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// A pose graph as the files of g2o hold it (R. Kuemmerle et al., "g2o: A general framework for
// graph optimization").
struct PoseGraph {
  struct Edge {
    std::int64_t from = 0, to = 0;
    Pose3 T_from_to;
    Matrix6d information = Matrix6d::Identity();  // order [translation; rotation], like BoxMinus
  };
  std::map<std::int64_t, Pose3> poses;  // T_world_pose, the initial guess of the file
  std::vector<Edge> edges;              // in the order of the file
  // The file had the translation-rotation blocks of its information matrices transposed, see
  // ReadG2o.
  bool transposed_coupling = false;
};

// Reads the lines VERTEX_SE3:QUAT (id x y z qx qy qz qw) and EDGE_SE3:QUAT (from to x y z qx qy qz
// qw and the upper triangle of the information, row by row); empty lines, comments (#) and FIX are
// passed over. Files that GTSAM wrote (cubicle.g2o, rim.g2o) have the translation-rotation block of
// the information transposed, as it reads it back the same way. So when some matrices are not
// positive definite as they stand, and all are with that block transposed, all are read so. Errors
// (kInput) name the line: other records, missing or bad numbers, a quaternion of length zero, an
// information matrix that is not positive definite, an edge from a pose to itself, ids given twice
// or never.
Expected<PoseGraph> ReadG2o(const std::filesystem::path& path);
// The same from a stream; `name` stands for the path in messages.
Expected<PoseGraph> ReadG2o(std::istream& stream, const std::string& name);

}  // namespace mlvi

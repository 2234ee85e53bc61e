// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "mlvi/base/error.h"

namespace mlvi {

struct PlyPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  // m
  float intensity = 0.0F;
};

enum class PlyFields { kPositions, kPositionsAndIntensities };

// Writes a point cloud as binary little-endian PLY (float x, y, z, intensity), point by point: a
// map need not be in memory as a whole. The number of points is filled in by Close().
class PlyWriter {
 public:
  // `comment` goes into the header; say which frame the points are in.
  static Expected<PlyWriter> Create(const std::string& path, const std::string& comment = "",
                                    PlyFields fields = PlyFields::kPositionsAndIntensities);

  void Write(const PlyPoint& point);
  std::uint64_t count() const { return count_; }
  // An error when anything could not be written (CannotWrite).
  Expected<void> Close();

 private:
  PlyWriter(std::string path, std::ofstream file, std::streamoff count_position, PlyFields fields)
      : path_(std::move(path)),
        file_(std::move(file)),
        count_position_(count_position),
        fields_(fields) {}

  std::string path_;
  std::ofstream file_;
  std::streamoff count_position_;
  PlyFields fields_;
  std::uint64_t count_ = 0;
};

Expected<void> WritePly(const std::vector<PlyPoint>& points, const std::string& path,
                        const std::string& comment = "");
// Reads the vertices of a binary little-endian PLY whose properties are scalars, x, y, z among them
// (float or double); intensity when there. Errors (kInput) tell what the header says instead.
Expected<std::vector<PlyPoint>> ReadPly(const std::string& path);

}  // namespace mlvi

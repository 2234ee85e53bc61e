// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "pose_file.h"

#include <algorithm>

#include "mlvi/io/euroc.h"
#include "mlvi/io/text_table.h"
#include "mlvi/io/tum.h"
#include "mlvi/io/whole_file.h"

namespace {

using mlvi::Expected;
using mlvi::MakeError;
using mlvi::TableLine;
constexpr mlvi::ErrorKind kKind = mlvi::ErrorKind::kInput;

bool IsInteger(const std::string& word) {
  return !word.empty() &&
         std::all_of(word.begin(), word.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// Integer stamps of that many digits are nanoseconds since 1970 (seconds have 10 until the year
// 2286).
bool IsEurocLine(const TableLine& line) {
  return line.words.size() >= 8 && line.words[0].size() >= 16 && IsInteger(line.words[0]);
}

Expected<mlvi::Trajectory> ReadEuroc(const std::string& path) {
  const auto states = mlvi::ReadEurocGroundTruth(path);
  if (!states) return tl::unexpected(states.error());
  mlvi::Trajectory trajectory;
  for (const mlvi::NavState& state : *states) {
    trajectory.push_back({.stamp = state.stamp, .pose = state.T_world_body});
  }
  return trajectory;
}

Expected<Eigen::Isometry3d> ParseKittiLine(const TableLine& line, const std::string& path) {
  if (line.words.size() != 12) {
    return MakeError(kKind, "{}:{}: {} columns; rows of this file have 12 (KITTI)", path,
                     line.number, line.words.size());
  }
  const auto v = mlvi::Numbers(line, 0, 12, path);
  if (!v) return tl::unexpected(v.error());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.affine() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(v->data());
  const double error =
      (pose.linear() * pose.linear().transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > 1e-3) {
    return MakeError(kKind,
                     "{}:{}: the 3x3 part is no rotation (R R^T is off by {:.2g}); expected a 3x4 "
                     "pose row by row",
                     path, line.number, error);
  }
  return pose;
}

Expected<std::vector<Eigen::Isometry3d>> ParseKitti(const std::vector<TableLine>& lines,
                                                    const std::string& path) {
  std::vector<Eigen::Isometry3d> poses;
  for (const TableLine& line : lines) {
    const auto pose = ParseKittiLine(line, path);
    if (!pose) return tl::unexpected(pose.error());
    poses.push_back(*pose);
  }
  return poses;
}

}  // namespace

Expected<PoseFile> ReadPoseFile(const std::string& path) {
  const auto text = mlvi::ReadWholeFile(path, kKind);
  if (!text) return tl::unexpected(text.error());
  const std::vector<TableLine> lines = mlvi::SplitTable(*text);
  if (lines.empty()) return MakeError(kKind, "{}: no pose in this file", path);
  if (lines[0].words.size() == 12) {
    return ParseKitti(lines, path).map([](auto&& poses) {
      return PoseFile{.stamped = {}, .unstamped = std::move(poses)};
    });
  }
  const auto trajectory = IsEurocLine(lines[0]) ? ReadEuroc(path) : mlvi::ParseTum(*text, path);
  if (!trajectory) return tl::unexpected(trajectory.error());
  return PoseFile{.stamped = *trajectory, .unstamped = {}};
}

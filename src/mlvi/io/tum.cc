// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/tum.h"

#include <cmath>

#include "mlvi/io/text_table.h"
#include "mlvi/io/whole_file.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

Expected<StampedPose> ParseLine(const TableLine& line, const std::string& origin) {
  if (line.words.size() != 8) {
    return MakeError(kKind, "{}:{}: {} columns; a TUM trajectory has 8: t x y z qx qy qz qw",
                     origin, line.number, line.words.size());
  }
  StampedPose pose;
  pose.stamp = ParseTime(line.words[0]);
  if (!pose.stamp.valid()) {
    return MakeError(kKind, "{}:{}: '{}' is no time in seconds{}", origin, line.number,
                     line.words[0], line.words[0].size() > 15 ? "; is it in nanoseconds?" : "");
  }
  const auto v = Numbers(line, 1, 7, origin);
  if (!v) return tl::unexpected(v.error());
  const Eigen::Vector3d position((*v)[0], (*v)[1], (*v)[2]);
  const Eigen::Quaterniond rotation((*v)[6], (*v)[3], (*v)[4], (*v)[5]);
  pose.has_rotation = rotation.norm() > 0.0;
  if (pose.has_rotation && std::abs(rotation.norm() - 1.0) > 0.01) {
    return MakeError(
        kKind,
        "{}:{}: quaternion norm {:.4f} is neither 1 nor 0 (position only); order is qx qy qz qw",
        origin, line.number, rotation.norm());
  }
  pose.pose = pose.has_rotation ? Pose3(rotation, position) : Pose3::FromTranslation(position);
  return pose;
}

}  // namespace

Expected<Trajectory> ParseTum(const std::string& text, const std::string& origin) {
  Trajectory trajectory;
  for (const TableLine& line : SplitTable(text)) {
    const auto pose = ParseLine(line, origin);
    if (!pose) return tl::unexpected(pose.error());
    trajectory.push_back(*pose);
  }
  if (trajectory.empty()) return MakeError(kKind, "{}: no pose in this file", origin);
  return trajectory;
}

Expected<Trajectory> ReadTum(const std::string& path) {
  const auto text = ReadWholeFile(path, kKind);
  if (!text) return tl::unexpected(text.error());
  return ParseTum(*text, path);
}

std::string TumLine(const StampedPose& pose) {
  const Eigen::Vector3d& p = pose.pose.translation();
  const Eigen::Quaterniond& q = pose.pose.rotation();
  const double scale = pose.has_rotation ? 1.0 : 0.0;
  return fmt::format("{} {:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f} {:.9f}\n", ToString(pose.stamp),
                     p.x(), p.y(), p.z(), scale * q.x(), scale * q.y(), scale * q.z(),
                     scale * q.w());
}

Expected<void> WriteTum(const Trajectory& trajectory, const std::string& path,
                        const std::string& comment) {
  std::string text = comment.empty() ? "" : "# " + comment + '\n';
  for (const StampedPose& pose : trajectory) text += TumLine(pose);
  return WriteWholeFile(path, text);
}

}  // namespace mlvi

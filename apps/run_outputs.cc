// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "run_outputs.h"

#include <fstream>

#include "mlvi/io/map_picture.h"
#include "mlvi/io/ply.h"
#include "mlvi/io/tum.h"

using namespace mlvi;

Expected<void> RunOutputs::Prepare(const SlamConfig& config) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) {
    return MakeError(ErrorKind::kConfiguration, "cannot make the output folder '{}': {}",
                     folder_.string(), error.message());
  }
  SlamConfig copy = config;
  return WriteText("config.yaml", ConfigDeclaration::Of(copy).ToYaml());
}

Expected<void> RunOutputs::Write(const Slam& slam, const nlohmann::ordered_json& summary) const {
  // The report first: it must be there even when the disk fills up with the map.
  if (auto written = WriteText("summary.json", summary.dump(2) + "\n"); !written) return written;
  const char* frame =
      "T_world_body: pose of the body (IMU) at the last firing of each sweep, or at each set of "
      "images without LiDAR";
  if (auto written = WriteTum(slam.odometry(), (folder_ / "odometry.tum").string(),
                              std::string(frame) + ", causal");
      !written) {
    return written;
  }
  if (auto written = WriteTum(slam.SmoothedTrajectory(), (folder_ / "trajectory.tum").string(),
                              std::string(frame) + ", smoothed");
      !written) {
    return written;
  }
  return WriteMap(slam);
}

Expected<void> RunOutputs::WriteMap(const Slam& slam) const {
  // Keyframes keep no intensities.
  auto writer = PlyWriter::Create((folder_ / "map.ply").string(),
                                  "points in the world frame, metres", PlyFields::kPositions);
  if (!writer) return tl::unexpected(writer.error());
  MapPicture picture(slam.SmoothedTrajectory());
  for (const Keyframe& keyframe : slam.graph().keyframes()) {
    if (!keyframe.points) continue;
    const Pose3 T_world_body = slam.graph().Estimate(keyframe.id).T_world_body;
    for (const Eigen::Vector3f& p_body : *keyframe.points) {
      const Eigen::Vector3d p_world = T_world_body * p_body.cast<double>();
      writer->Write({.position = p_world.cast<float>()});
      picture.Add(p_world);
    }
  }
  if (auto closed = writer->Close(); !closed) return closed;
  if (slam.odometry().empty()) return {};  // nothing to draw
  return picture.Save((folder_ / "map.png").string());
}

Expected<void> RunOutputs::WriteText(const std::string& name, const std::string& text) const {
  std::ofstream file(folder_ / name, std::ios::binary);
  file << text;
  if (file.close(), !file) {
    return MakeError(ErrorKind::kConfiguration, "cannot write '{}': disk full or not permitted",
                     (folder_ / name).string());
  }
  return {};
}

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "run_outputs.h"

#include "mlvi/io/map_picture.h"
#include "mlvi/io/ply.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/tum.h"
#include "mlvi/io/whole_file.h"

using namespace mlvi;

namespace {

const std::string kFrame =
    "T_world_body: pose of the body (IMU) at the last firing of each sweep, or at each set of "
    "images without LiDAR";

std::string Text(const nlohmann::ordered_json& summary) { return summary.dump(2) + "\n"; }

// Calls visit(p_world) for the points of all keyframes, after smoothing.
template <typename Visit>
void ForEachPoint(const Slam& slam, const Visit& visit) {
  for (const Keyframe& keyframe : slam.graph().keyframes()) {
    if (!keyframe.points) continue;
    const Pose3 T_world_body = slam.graph().Estimate(keyframe.id).T_world_body;
    for (const Eigen::Vector3f& p_body : *keyframe.points)
      visit(T_world_body * p_body.cast<double>());
  }
}

}  // namespace

Expected<void> RunOutputs::Prepare(const SlamConfig& config, bool depth_pictures) const {
  std::error_code error;
  std::filesystem::create_directories(depth_pictures ? this->depth_pictures() : folder_, error);
  if (error) {
    return MakeError(ErrorKind::kConfiguration, "cannot make the output folder '{}': {}",
                     folder_.string(), error.message());
  }
  SlamConfig copy = config;
  return WriteWholeFile(Path("config.yaml"), ConfigDeclaration::Of(copy).ToYaml());
}

Expected<void> RunOutputs::Write(const Slam& slam, const Rig& rig,
                                 nlohmann::ordered_json summary) const {
  // The report first: it must be there even when the disk fills up with the map.
  Expected<void> written = WriteWholeFile(Path("summary.json"), Text(summary));
  for (const Expected<void>& part :
       {WriteTum(slam.odometry(), Path("odometry.tum"), kFrame + ", causal"),
        WriteTum(slam.SmoothedTrajectory(), Path("trajectory.tum"), kFrame + ", smoothed"),
        SaveRig(rig, Path("calibrated_rig.yaml")), WriteMap(slam), WritePicture(slam)}) {
    if (part) continue;
    summary["not_written"].push_back(part.error().message);
    if (written) written = part;
  }
  if (!summary["not_written"].empty()) {
    // Beside the first report, which stays when there is no room for this one.
    const std::string fuller = Path("summary.json.new");
    std::error_code ignored;
    if (WriteWholeFile(fuller, Text(summary))) {
      std::filesystem::rename(fuller, Path("summary.json"), ignored);
    } else {
      std::filesystem::remove(fuller, ignored);
    }
  }
  return written;
}

Expected<void> RunOutputs::WriteMap(const Slam& slam) const {
  // Keyframes keep no intensities.
  auto writer = PlyWriter::Create(Path("map.ply"), "points in the world frame, metres",
                                  PlyFields::kPositions);
  if (!writer) return tl::unexpected(writer.error());
  ForEachPoint(slam, [&](const Eigen::Vector3d& p_world) {
    writer->Write({.position = p_world.cast<float>()});
  });
  return writer->Close();
}

Expected<void> RunOutputs::WritePicture(const Slam& slam) const {
  if (slam.odometry().empty()) return {};  // nothing to draw
  MapPicture picture(slam.SmoothedTrajectory());
  ForEachPoint(slam, [&](const Eigen::Vector3d& p_world) { picture.Add(p_world); });
  return picture.Save(Path("map.png"));
}

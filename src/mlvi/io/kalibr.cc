// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/kalibr.h"

#include <algorithm>

#include "mlvi/io/whole_file.h"
#include "mlvi/io/yaml_section.h"
#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

// The name of our model for a pair of Kalibr's, or "".
std::string ModelName(const std::string& camera, const std::string& distortion) {
  if (camera == "pinhole" && distortion == "equidistant") return "equidistant";
  if (camera == "pinhole" && distortion == "radtan") return "pinhole_radtan";
  if (camera == "omni" && distortion == "radtan") return "mei";
  return camera == "ds" && distortion == "none" ? "double_sphere" : "";
}

std::shared_ptr<const CameraModel> ReadModel(YamlSection& section) {
  std::string camera, distortion_model;
  std::vector<double> intrinsics, distortion, resolution;
  section.Require("camera_model", camera);
  section.Require("distortion_model", distortion_model);
  if (!section.Read("intrinsics", intrinsics, 0)) section.ReportMissing("intrinsics");
  section.Read("distortion_coeffs", distortion, 0);
  if (!section.Read("resolution", resolution, 2)) section.ReportMissing("resolution");
  const std::string name = ModelName(camera, distortion_model);
  if (name.empty()) {
    section.Report(
        fmt::format("camera_model {} with distortion_model {} is not supported; pinhole + "
                    "equidistant, pinhole + "
                    "radtan, omni + radtan and ds + none are",
                    camera, distortion_model));
    return nullptr;
  }
  const bool sensible = resolution.size() == 2 && resolution[0] >= 1 && resolution[1] >= 1 &&
                        resolution[0] <= 1e5 && resolution[1] <= 1e5;
  if (!sensible) {
    section.Report(
        fmt::format("{}: expected width and height in px", section.PathOf("resolution")));
    return nullptr;
  }
  if (name == "double_sphere") distortion.clear();  // Kalibr writes zeros
  const auto model = MakeCameraModel(name, static_cast<int>(resolution[0]),
                                     static_cast<int>(resolution[1]), intrinsics, distortion);
  if (!model) {
    section.Report(model.error().message);
    return nullptr;
  }
  return *model;
}

// The entry of the rig with that name, made when absent.
CameraSpec& CameraOf(const std::string& name, Rig& rig) {
  const auto found = std::find_if(rig.cameras.begin(), rig.cameras.end(),
                                  [&](const CameraSpec& camera) { return camera.name == name; });
  if (found != rig.cameras.end()) return *found;
  CameraSpec& camera = rig.cameras.emplace_back();
  camera.name = name;
  return camera;
}

// Fills one camera; `T_previous_imu` is that of the camera before in the chain, and becomes that of
// this one.
void ReadCamera(YamlSection& section, const std::string& name, std::optional<Pose3>& T_camera_imu,
                Rig& rig) {
  CameraSpec& camera = CameraOf(name, rig);
  camera.model = ReadModel(section);
  section.Read("rostopic", camera.topic);
  section.Read("timeshift_cam_imu", camera.time_offset);
  section.Node("cam_overlaps");
  Pose3 T, T_camera_previous;
  const bool has_previous = section.Read("T_cn_cnm1", T_camera_previous);
  if (section.Read("T_cam_imu", T)) {
    T_camera_imu = T;
  } else if (has_previous && T_camera_imu) {
    T_camera_imu = T_camera_previous * *T_camera_imu;
  } else {
    section.Report(fmt::format(
        "missing field '{}': a chain of cameras alone does not tell where the IMU is; run "
        "Kalibr's camera-IMU calibration",
        section.PathOf("T_cam_imu")));
    return;
  }
  camera.T_body_camera = T_camera_imu->inverse();
  section.Finish();
}

}  // namespace

Expected<std::vector<std::string>> ImportKalibrCamchainText(const std::string& yaml,
                                                            const std::string& origin, Rig& rig) {
  const auto document = ParseYaml(yaml, origin);
  if (!document) return tl::unexpected(document.error());
  YamlErrors errors(origin, kKind);
  YamlSection root(*document, "", errors);
  Rig changed = rig;
  std::optional<Pose3> T_camera_imu;
  std::vector<std::string> names;
  while (true) {
    const std::string name = fmt::format("cam{}", names.size());
    auto section = root.Section(name);
    if (!section) break;
    ReadCamera(*section, name, T_camera_imu, changed);
    names.push_back(name);
  }
  if (names.empty()) root.ReportMissing("cam0");
  root.Finish();
  if (errors.first()) return tl::unexpected(*errors.first());
  rig = std::move(changed);
  return names;
}

Expected<void> ImportKalibrImuText(const std::string& yaml, const std::string& origin, Rig& rig) {
  const auto document = ParseYaml(yaml, origin);
  if (!document) return tl::unexpected(document.error());
  YamlErrors errors(origin, kKind);
  // Bare, or under "imu0" as the calibration writes it; further keys (T_i_b, model) say nothing
  // that the rig holds.
  const bool nested = document->IsMap() && (*document)["imu0"].IsDefined();
  YamlSection section(nested ? (*document)["imu0"] : *document, nested ? "imu0" : "", errors);
  Rig changed = rig;
  section.Require("accelerometer_noise_density", changed.imu.noise.accelerometer_density);
  section.Require("gyroscope_noise_density", changed.imu.noise.gyroscope_density);
  section.Require("accelerometer_random_walk", changed.imu.noise.accelerometer_random_walk);
  section.Require("gyroscope_random_walk", changed.imu.noise.gyroscope_random_walk);
  section.Read("update_rate", changed.imu.rate_hz);
  section.Read("rostopic", changed.imu.topic);
  if (errors.first()) return tl::unexpected(*errors.first());
  rig = std::move(changed);
  return {};
}

Expected<std::vector<std::string>> ImportKalibrCamchain(const std::string& path, Rig& rig) {
  const auto text = ReadWholeFile(path, kKind);
  if (!text) return tl::unexpected(text.error());
  return ImportKalibrCamchainText(*text, path, rig);
}

Expected<void> ImportKalibrImu(const std::string& path, Rig& rig) {
  const auto text = ReadWholeFile(path, kKind);
  if (!text) return tl::unexpected(text.error());
  return ImportKalibrImuText(*text, path, rig);
}

}  // namespace mlvi

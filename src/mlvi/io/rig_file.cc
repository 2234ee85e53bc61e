// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/rig_file.h"

#include <fmt/ranges.h>

#include <filesystem>

#include "mlvi/base/suggestion.h"
#include "mlvi/io/builtin_rigs.h"
#include "mlvi/io/camera_yaml.h"
#include "mlvi/io/image_decoder.h"
#include "mlvi/io/whole_file.h"
#include "mlvi/io/yaml_section.h"

namespace mlvi {
namespace {

const std::vector<std::string> kAccelerationUnits = {"auto", "m/s^2", "g"};
const std::vector<std::string> kPointTimings = {"auto", "instantaneous"};

ImuSpec ReadImu(YamlSection section) {
  ImuSpec imu;
  section.Require("topic", imu.topic);
  section.Require("rate_hz", imu.rate_hz);
  if (auto noise = section.Section("noise")) {
    noise->Require("accelerometer_density", imu.noise.accelerometer_density);
    noise->Require("gyroscope_density", imu.noise.gyroscope_density);
    noise->Require("accelerometer_random_walk", imu.noise.accelerometer_random_walk);
    noise->Require("gyroscope_random_walk", imu.noise.gyroscope_random_walk);
    noise->Finish();
  } else {
    section.ReportMissing("noise");
  }
  section.Read("initial_accelerometer_bias_sigma", imu.initial_accelerometer_bias_sigma);
  section.Read("initial_gyroscope_bias_sigma", imu.initial_gyroscope_bias_sigma);
  section.Read("accelerometer_saturation", imu.accelerometer_saturation);
  section.Read("gyroscope_saturation", imu.gyroscope_saturation);
  section.Read("acceleration_unit", imu.acceleration_unit, kAccelerationUnits);
  section.Read("time_offset_s", imu.time_offset);
  section.Finish();
  return imu;
}

LidarSpec ReadLidar(YamlSection section) {
  LidarSpec lidar;
  section.Require("topic", lidar.topic);
  section.Require("T_body_lidar", lidar.T_body_lidar);
  section.Require("rate_hz", lidar.rate_hz);
  section.Read("model", lidar.model);
  section.Read("rings", lidar.rings);
  section.Read("min_range", lidar.min_range);
  section.Read("max_range", lidar.max_range);
  section.Read("range_noise", lidar.range_noise);
  section.Read("beam_noise", lidar.beam_noise);
  section.Read("point_timing", lidar.point_timing, kPointTimings);
  section.Read("time_offset_s", lidar.time_offset);
  section.Finish();
  return lidar;
}

Rig ReadRig(YamlSection& root) {
  Rig rig;
  root.Require("name", rig.name);
  root.Read("gravity", rig.gravity);
  if (auto imu = root.Section("imu")) {
    rig.imu = ReadImu(*imu);
  } else {
    root.ReportMissing("imu");
  }
  if (auto lidar = root.Section("lidar")) rig.lidar = ReadLidar(*lidar);
  for (YamlSection& camera : root.Sections("cameras")) {
    rig.cameras.push_back(ReadCamera(camera));
  }
  Eigen::Vector3d p_body_pano = Eigen::Vector3d::Zero();
  if (root.Read("p_body_pano", p_body_pano)) rig.p_body_pano = p_body_pano;
  root.Read("T_body_groundtruth", rig.T_body_groundtruth);
  root.Finish();
  return rig;
}

void AppendImu(const ImuSpec& imu, std::string& yaml) {
  yaml += fmt::format(
      "imu:\n  topic: {}\n  rate_hz: {}\n  noise:\n    accelerometer_density: {}  # "
      "m/s^2/sqrt(Hz)\n"
      "    gyroscope_density: {}  # rad/s/sqrt(Hz)\n    accelerometer_random_walk: {}  # "
      "m/s^3/sqrt(Hz)\n"
      "    gyroscope_random_walk: {}  # rad/s^2/sqrt(Hz)\n",
      QuoteYaml(imu.topic), imu.rate_hz, imu.noise.accelerometer_density,
      imu.noise.gyroscope_density, imu.noise.accelerometer_random_walk,
      imu.noise.gyroscope_random_walk);
  yaml += fmt::format(
      "  initial_accelerometer_bias_sigma: {}  # m/s^2\n  initial_gyroscope_bias_sigma: {}  # "
      "rad/s\n"
      "  accelerometer_saturation: {}  # m/s^2\n  gyroscope_saturation: {}  # rad/s\n"
      "  acceleration_unit: {}\n  time_offset_s: {}\n",
      imu.initial_accelerometer_bias_sigma, imu.initial_gyroscope_bias_sigma,
      imu.accelerometer_saturation, imu.gyroscope_saturation,
      kAccelerationUnits.at(static_cast<std::size_t>(imu.acceleration_unit)),
      SecondsText(imu.time_offset));
}

void AppendLidar(const LidarSpec& lidar, std::string& yaml) {
  yaml += fmt::format(
      "lidar:\n  topic: {}\n  model: {}\n  T_body_lidar: {}\n  rings: {}\n  rate_hz: {}\n"
      "  min_range: {}  # m\n  max_range: {}  # m\n  range_noise: {}  # m\n  beam_noise: {}  # "
      "rad\n"
      "  point_timing: {}\n  time_offset_s: {}\n",
      QuoteYaml(lidar.topic), QuoteYaml(lidar.model), PoseYaml(lidar.T_body_lidar), lidar.rings,
      lidar.rate_hz, lidar.min_range, lidar.max_range, lidar.range_noise, lidar.beam_noise,
      kPointTimings.at(static_cast<std::size_t>(lidar.point_timing)),
      SecondsText(lidar.time_offset));
}

const internal::BuiltinRig* FindBuiltin(const std::string& name) {
  for (const internal::BuiltinRig& rig : internal::BuiltinRigs()) {
    if (rig.name == name) return &rig;
  }
  return nullptr;
}

Expected<std::shared_ptr<const Image>> LoadMask(const std::string& path) {
  const auto bytes = ReadWholeFile(path, ErrorKind::kConfiguration);
  if (!bytes) return tl::unexpected(bytes.error());
  auto mask = DecodeCompressedImage(
      {.encoding = "mask",
       .data = ByteSpan(reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size())});
  if (!mask) {
    return MakeError(ErrorKind::kConfiguration,
                     "mask file '{}' is no image that can be read (PNG, JPEG, PGM)", path);
  }
  return std::make_shared<const Image>(std::move(*mask));
}

Expected<Rig> LoadRigFile(const std::string& path) {
  const auto text = ReadWholeFile(path, ErrorKind::kConfiguration);
  if (!text) return tl::unexpected(text.error());
  auto rig = ParseRig(*text, path);
  if (!rig) return rig;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  for (CameraSpec& camera : rig->cameras) {
    if (camera.mask_file.empty()) continue;
    camera.mask_file = (folder / camera.mask_file).string();
    auto mask = LoadMask(camera.mask_file);
    if (!mask)
      return MakeError(mask.error().kind, "{}: mask of {}: {}", path, camera.name,
                       mask.error().message);
    camera.mask = *mask;
  }
  if (auto valid = rig->Validate(); !valid)
    return MakeError(valid.error().kind, "{}: {}", path, valid.error().message);
  return rig;
}

}  // namespace

Expected<Rig> ParseRig(const std::string& yaml, const std::string& origin) {
  const auto document = ParseYaml(yaml, origin);
  if (!document) return tl::unexpected(document.error());
  YamlErrors errors(origin, ErrorKind::kConfiguration);
  YamlSection root(*document, "", errors);
  Rig rig = ReadRig(root);
  if (errors.first()) return tl::unexpected(*errors.first());
  if (auto valid = rig.Validate(); !valid) {
    return MakeError(valid.error().kind, "{}: {}", origin, valid.error().message);
  }
  return rig;
}

Expected<Rig> LoadRig(const std::string& name_or_path) {
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(name_or_path, ignored);
  if (!is_folder && std::filesystem::exists(name_or_path, ignored))
    return LoadRigFile(name_or_path);
  if (const internal::BuiltinRig* rig = FindBuiltin(name_or_path)) {
    return ParseRig(std::string(rig->yaml), fmt::format("built-in rig {}", rig->name));
  }
  if (is_folder) return LoadRigFile(name_or_path);  // which says so
  return MakeError(ErrorKind::kConfiguration,
                   "rig '{}': no such file, and no built-in rig of that name (there are {}){}",
                   name_or_path, fmt::join(BuiltinRigNames(), ", "),
                   DidYouMean(name_or_path, BuiltinRigNames()));
}

std::vector<std::string> BuiltinRigNames() {
  std::vector<std::string> names;
  for (const internal::BuiltinRig& rig : internal::BuiltinRigs()) names.emplace_back(rig.name);
  return names;
}

std::string RigToYaml(const Rig& rig) {
  std::string yaml =
      fmt::format("name: {}\ngravity: {}  # m/s^2\n", QuoteYaml(rig.name), rig.gravity);
  AppendImu(rig.imu, yaml);
  if (rig.lidar) AppendLidar(*rig.lidar, yaml);
  if (!rig.cameras.empty()) yaml += "cameras:\n";
  for (const CameraSpec& camera : rig.cameras) yaml += CameraYaml(camera);
  if (rig.p_body_pano) {
    yaml += fmt::format("p_body_pano: {}  # m\n", VectorYaml(*rig.p_body_pano));
  }
  yaml += fmt::format("T_body_groundtruth: {}\n", PoseYaml(rig.T_body_groundtruth));
  return yaml;
}

Expected<void> SaveRig(const Rig& rig, const std::string& path) {
  namespace fs = std::filesystem;
  Rig saved = rig;
  for (CameraSpec& camera : saved.cameras) {
    if (!camera.mask) continue;
    // Read from there by this process; a rig file names it from its own folder.
    camera.mask_file =
        fs::proximate(fs::absolute(camera.mask_file), fs::absolute(path).parent_path()).string();
  }
  return WriteWholeFile(path, RigToYaml(saved));
}

}  // namespace mlvi

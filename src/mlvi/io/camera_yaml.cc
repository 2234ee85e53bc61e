// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/io/camera_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "mlvi/sensors/camera_model.h"

namespace mlvi {
namespace {

void ReadModel(YamlSection& section, CameraSpec& camera) {
  std::string name;
  std::vector<double> intrinsics, distortion, size;
  section.Require("model", name);
  if (!section.Read("intrinsics", intrinsics, 0)) section.ReportMissing("intrinsics");
  section.Read("distortion", distortion, 0);
  if (!section.Read("size", size, 2)) section.ReportMissing("size");
  if (size.size() != 2) return;
  if (size[0] < 1.0 || size[1] < 1.0 || size[0] > 1e5 || size[1] > 1e5) {
    section.Report(fmt::format("{} = [{}, {}]: width and height must be in [1, 100000] px",
                               section.PathOf("size"), size[0], size[1]));
    return;
  }
  const auto model = MakeCameraModel(name, static_cast<int>(size[0]), static_cast<int>(size[1]),
                                     intrinsics, distortion);
  if (model) camera.model = *model;
  if (!model) section.Report(fmt::format("{}: {}", section.PathOf("model"), model.error().message));
}

// Calibration files put the parameters of the projection before fx, those of the distortion behind
// cy.
bool LeadsFocalLength(const std::string& parameter) {
  return parameter == "xi" || parameter == "alpha";
}

}  // namespace

CameraSpec ReadCamera(YamlSection& section) {
  CameraSpec camera;
  section.Require("name", camera.name);
  section.Require("topic", camera.topic);
  ReadModel(section, camera);
  section.Require("T_body_camera", camera.T_body_camera);
  section.Read("rate_hz", camera.rate_hz);
  section.Read("time_offset_s", camera.time_offset);
  section.Read("valid_radius_px", camera.valid_radius_px);
  section.Read("mask_file", camera.mask_file);
  section.Finish();
  return camera;
}

CameraParameterLists SplitCameraParameters(const CameraModel& model) {
  CameraParameterLists lists;
  const std::vector<std::string> names = model.parameter_names();
  const Eigen::VectorXd& p = model.parameters();
  std::vector<double> focal(p.data(), p.data() + 4);
  for (std::size_t i = 4; i < names.size(); ++i) {
    const double value = p[static_cast<Eigen::Index>(i)];
    (LeadsFocalLength(names[i]) ? lists.intrinsics : lists.distortion).push_back(value);
  }
  lists.intrinsics.insert(lists.intrinsics.end(), focal.begin(), focal.end());
  return lists;
}

std::string CameraYaml(const CameraSpec& camera) {
  const CameraParameterLists parameters = SplitCameraParameters(*camera.model);
  std::string yaml = fmt::format(
      "  - name: {}\n    topic: {}\n    model: {}\n    intrinsics: [{}]\n    distortion: [{}]\n"
      "    size: [{}, {}]\n    T_body_camera: {}\n    rate_hz: {}\n    time_offset_s: {}\n"
      "    valid_radius_px: {}\n",
      QuoteYaml(camera.name), QuoteYaml(camera.topic), camera.model->name(),
      fmt::join(parameters.intrinsics, ", "), fmt::join(parameters.distortion, ", "),
      camera.model->width(), camera.model->height(), PoseYaml(camera.T_body_camera), camera.rate_hz,
      SecondsText(camera.time_offset), camera.valid_radius_px);
  if (!camera.mask_file.empty())
    yaml += fmt::format("    mask_file: {}\n", QuoteYaml(camera.mask_file));
  return yaml;
}

std::string QuoteYaml(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string VectorYaml(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z());
}

std::string PoseYaml(const Pose3& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  return fmt::format("{{t: {}, q_xyzw: [{}, {}, {}, {}]}}", VectorYaml(pose.translation()), q.x(),
                     q.y(), q.z(), q.w());
}

std::string SecondsText(Duration duration) {
  const std::int64_t ns = duration.nanoseconds();
  return fmt::format("{}{}.{:09d}", ns < 0 ? "-" : "", std::abs(ns) / 1'000'000'000,
                     std::abs(ns) % 1'000'000'000);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "rig_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "exit_code.h"
#include "mlvi/io/kalibr.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/sensors/camera_model.h"

namespace {

using namespace mlvi;

constexpr ErrorKind kKind = ErrorKind::kConfiguration;

struct RigArguments {
  std::string base, camchain, imu, name, output;
};

Expected<Rig> BaseRig(const RigArguments& arguments) {
  if (!arguments.base.empty()) return LoadRig(arguments.base);
  if (arguments.camchain.empty() || arguments.imu.empty()) {
    return MakeError(
        kKind,
        "a rig needs at least an IMU and something to see with: add --kalibr CAMCHAIN and "
        "--kalibr-imu IMU "
        "for a rig of cameras, or --base RIG for one whose other sensors are to be kept");
  }
  Rig rig;
  rig.name =
      arguments.output.empty() ? "kalibr" : std::filesystem::path(arguments.output).stem().string();
  return rig;
}

// What a user checks at a glance: a transform that was given the wrong way round puts cameras where
// none is.
void PrintCamera(const CameraSpec& camera, const std::string& origin) {
  Eigen::Vector3d ahead = camera.T_body_camera.rotation() * Eigen::Vector3d::UnitZ();
  ahead = (100.0 * ahead).array().round() / 100.0 + 0.0;  // no "-0.00"
  const Eigen::Vector3d& p = camera.T_body_camera.translation();
  fmt::print(stderr,
             "{}  {} {} x {} px, {}; in the IMU's frame at ({:.3f}, {:.3f}, {:.3f}) m, looking "
             "along ({:.2f}, {:.2f}, "
             "{:.2f}); time offset {:+.4f} s  (from {})\n",
             camera.name, camera.model->name(), camera.model->width(), camera.model->height(),
             camera.topic, p.x(), p.y(), p.z(), ahead.x(), ahead.y(), ahead.z(),
             camera.time_offset.seconds(), origin);
}

Expected<int> MakeRig(const RigArguments& arguments) {
  Expected<Rig> rig = BaseRig(arguments);
  if (!rig) return tl::unexpected(rig.error());
  std::vector<std::string> calibrated;
  if (!arguments.camchain.empty()) {
    auto imported = ImportKalibrCamchain(arguments.camchain, *rig);
    if (!imported) return tl::unexpected(imported.error());
    calibrated = std::move(*imported);
  }
  if (!arguments.imu.empty()) {
    if (const auto imported = ImportKalibrImu(arguments.imu, *rig); !imported)
      return tl::unexpected(imported.error());
  }
  if (!arguments.name.empty()) rig->name = arguments.name;
  if (const auto valid = rig->Validate(); !valid) {
    return MakeError(kKind, "the rig would not be valid: {}", valid.error().message);
  }
  for (const CameraSpec& camera : rig->cameras) {
    const bool is_new = std::ranges::find(calibrated, camera.name) != calibrated.end();
    PrintCamera(camera, is_new ? arguments.camchain : arguments.base);
  }
  if (arguments.output.empty()) {
    fmt::print("{}", RigToYaml(*rig));
    return kExitDone;
  }
  return SaveRig(*rig, arguments.output).map([] { return kExitDone; });
}

}  // namespace

void AddRigCommand(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<RigArguments>();
  CLI::App* command = app.add_subcommand(
      "rig", "Make a rig file from a calibration by Kalibr, or of a built-in rig");
  command->add_option("--base", arguments->base,
                      "Rig file, or name of a built-in rig: what the calibration does not tell "
                      "(LiDAR, rates, masks)");
  command->add_option("--kalibr", arguments->camchain,
                      "camchain-imucam.yaml: cameras with T_cam_imu; replaces those of the base "
                      "with the same names");
  command->add_option("--kalibr-imu", arguments->imu, "imu.yaml: noise, rate and topic of the IMU");
  command->add_option("--name", arguments->name,
                      "Name of the rig (default: the base's, or that of the file)");
  command->add_option("-o,--output", arguments->output,
                      "Rig file to write (default: standard output)");
  command->callback([arguments, &exit_code] { exit_code = Report(MakeRig(*arguments)); });
}

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "fault_options.h"

#include <charconv>
#include <numbers>
#include <sstream>

namespace mlvi {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180.0;

std::optional<FaultWindow> WindowOf(const std::vector<double>& pair) {
  if (pair.empty()) return std::nullopt;
  return FaultWindow{.start = pair[0], .length = pair[1]};
}

// "NAME,NUMBER,NUMBER..."
struct NamedNumbers {
  std::string name;
  std::vector<double> numbers;
};

Expected<NamedNumbers> Parse(const std::string& option, const std::string& text, std::size_t least,
                             std::size_t most, const std::string& form) {
  NamedNumbers result;
  std::istringstream stream(text);
  std::getline(stream, result.name, ',');
  std::string field;
  bool good = !result.name.empty();
  while (std::getline(stream, field, ',')) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    good = good && error == std::errc() && end == field.data() + field.size();
    result.numbers.push_back(value);
  }
  if (good && result.numbers.size() >= least && result.numbers.size() <= most) return result;
  return MakeError(ErrorKind::kConfiguration, "{} {}: expected {}", option, text, form);
}

Expected<void> AddCameraFaults(const std::string& option, const std::vector<std::string>& texts,
                               CameraFailure failure, SequenceFaults& faults) {
  for (const std::string& text : texts) {
    const auto parsed = Parse(option, text, 2, 2, "CAMERA,START,LENGTH");
    if (!parsed) return tl::unexpected(parsed.error());
    faults.cameras.push_back(
        {parsed->name, failure, {.start = parsed->numbers[0], .length = parsed->numbers[1]}});
  }
  return {};
}

Expected<void> AddNamedFaults(const FaultArguments& arguments, SequenceFaults& faults) {
  for (const std::string& text : arguments.clocks) {
    const auto parsed = Parse("--clock", text, 1, 3, "SENSOR,OFFSET[,DRIFT_PPM[,JITTER]]");
    if (!parsed) return tl::unexpected(parsed.error());
    std::vector<double> numbers = parsed->numbers;
    numbers.resize(3, 0.0);
    const ClockError clock{.offset = numbers[0], .drift_ppm = numbers[1], .jitter = numbers[2]};
    if (!faults.clocks.emplace(parsed->name, clock).second) {
      return MakeError(ErrorKind::kConfiguration,
                       "--clock {}: a second clock of {}; give offset, drift and jitter at once",
                       text, parsed->name);
    }
  }
  for (const std::string& text : arguments.triggers) {
    const auto parsed = Parse("--trigger", text, 1, 1, "CAMERA,DELAY");
    if (!parsed) return tl::unexpected(parsed.error());
    faults.triggers[parsed->name] = parsed->numbers[0];
  }
  for (const std::string& text : arguments.lens_patches) {
    const auto parsed =
        Parse("--lens-patch", text, 3, 3, "CAMERA,U,V,RADIUS (shares of the image)");
    if (!parsed) return tl::unexpected(parsed.error());
    faults.lens_patches.push_back(
        {parsed->name, parsed->numbers[0], parsed->numbers[1], parsed->numbers[2]});
  }
  return AddCameraFaults("--camera-dead", arguments.dead_cameras, CameraFailure::kDead, faults)
      .and_then([&] {
        return AddCameraFaults("--camera-frozen", arguments.frozen_cameras, CameraFailure::kFrozen,
                               faults);
      })
      .and_then([&] {
        return AddCameraFaults("--corrupted-images", arguments.corrupted_cameras,
                               CameraFailure::kCorrupted, faults);
      });
}

Json ToJson(const std::optional<FaultWindow>& window) {
  if (!window) return nullptr;
  return {{"start_s", window->start}, {"length_s", window->length}};
}

const char* NameOf(CameraFailure failure) {
  switch (failure) {
    case CameraFailure::kFrozen: return "frozen";
    case CameraFailure::kCorrupted: return "corrupted";
    case CameraFailure::kDead: break;
  }
  return "dead";
}

Json CamerasJson(const SequenceFaults& faults) {
  Json json = Json::array();
  for (const CameraFault& fault : faults.cameras) {
    json.push_back({{"camera", fault.camera},
                    {"failure", NameOf(fault.failure)},
                    {"start_s", fault.window.start},
                    {"length_s", fault.window.length}});
  }
  return json;
}

}  // namespace

void AddFaultOptions(CLI::App& command, FaultArguments& a) {
  const auto numbers = [&](const char* name, std::vector<double>& value, int count,
                           const char* description) {
    command.add_option(name, value, description)->expected(count)->delimiter(',')->group("Faults");
  };
  const auto texts = [&](const char* name, std::vector<std::string>& value,
                         const char* description) {
    command.add_option(name, value, description)->expected(1)->take_all()->group("Faults");
  };
  numbers("--lidar-gap", a.lidar_gap, 2, "START,LENGTH: seconds without sweeps");
  numbers("--imu-gap", a.imu_gap, 2, "START,LENGTH: seconds without IMU samples");
  numbers("--empty-sweeps", a.empty_sweeps, 2, "START,LENGTH: seconds of sweeps without returns");
  numbers("--nan-points", a.nan_points, 2,
          "START,LENGTH: seconds in which a tenth of the points is NaN");
  numbers("--corrupted-sweeps", a.corrupted_sweeps, 2,
          "START,LENGTH: seconds in which LiDAR messages are cut off in the middle");
  numbers("--imu-saturation", a.imu_saturation, 2,
          "ACCELERATION,RATE: limits of the IMU in m/s^2 and rad/s");
  numbers("--imu-vibration", a.imu_vibration, 2,
          "ACCELERATION,RATE: rms of shaking at 20 to 120 Hz, per axis, in m/s^2 and rad/s");
  numbers("--imu-warm-up", a.imu_warm_up, 3,
          "ACCELERATION,RATE,SECONDS: what biases settle by as the IMU warms up, and how fast");
  numbers("--imu-scale", a.imu_scale, 2,
          "ACCELEROMETER,GYROSCOPE: largest errors of scale and of axes' directions (0.01 = 1 %)");
  numbers("--nan-imu", a.nan_imu, 2, "START,LENGTH: seconds in which IMU samples are NaN");
  numbers("--corrupted-imu", a.corrupted_imu, 2,
          "START,LENGTH: seconds in which IMU messages are cut off in the middle");
  numbers("--image-gap", a.image_gap, 2, "START,LENGTH: seconds without images");
  texts("--camera-dead", a.dead_cameras, "CAMERA,START,LENGTH: seconds without its images");
  texts("--camera-frozen", a.frozen_cameras,
        "CAMERA,START,LENGTH: seconds in which it repeats one image");
  texts("--corrupted-images", a.corrupted_cameras,
        "CAMERA,START,LENGTH: seconds in which its messages hold half of their data");
  texts("--lens-patch", a.lens_patches,
        "CAMERA,U,V,RADIUS: dirt on the lens, in shares of the image");
  numbers("--exposure-jump", a.exposure_jump, 3,
          "START,LENGTH,FACTOR: seconds in which images are exposed FACTOR times as much");
  numbers("--lights-off", a.lights_off, 2, "START,LENGTH: seconds without the lamps of the place");
  numbers("--time-jump", a.time_jump, 2,
          "START,BACK: from START on all stamps are BACK seconds too early");
  texts("--clock", a.clocks,
        "SENSOR,OFFSET[,DRIFT_PPM[,JITTER]]: stamps of imu, lidar or a camera are late by OFFSET "
        "seconds, growing, and by up to JITTER seconds at random");
  texts(
      "--trigger", a.triggers,
      "CAMERA,DELAY: it takes its images DELAY seconds after the other cameras, with right stamps");
  numbers("--extrinsics-error", a.extrinsics_error, 2,
          "DEGREES,METRES: how far true mounts of LiDAR and cameras are from the rig file's");
  command.add_flag("--imu-in-g", a.imu_in_g, "Accelerations in g instead of m/s^2")
      ->group("Faults");
}

Expected<SequenceFaults> FaultsOf(const FaultArguments& a) {
  SequenceFaults faults{.lidar_gap = WindowOf(a.lidar_gap),
                        .empty_sweeps = WindowOf(a.empty_sweeps),
                        .nan_points = WindowOf(a.nan_points),
                        .corrupted_sweeps = WindowOf(a.corrupted_sweeps),
                        .imu_gap = WindowOf(a.imu_gap),
                        .nan_imu = WindowOf(a.nan_imu),
                        .corrupted_imu = WindowOf(a.corrupted_imu),
                        .imu_in_g = a.imu_in_g,
                        .image_gap = WindowOf(a.image_gap),
                        .lights_off = WindowOf(a.lights_off)};
  if (!a.imu_saturation.empty())
    faults.imu_saturation = ImuSaturation{a.imu_saturation[0], a.imu_saturation[1]};
  if (!a.imu_vibration.empty())
    faults.imu_vibration = ImuVibration{a.imu_vibration[0], a.imu_vibration[1]};
  if (!a.imu_warm_up.empty())
    faults.imu_warm_up = ImuWarmUp{a.imu_warm_up[0], a.imu_warm_up[1], a.imu_warm_up[2]};
  if (!a.imu_scale.empty()) faults.imu_sensitivity = ImuSensitivity{a.imu_scale[0], a.imu_scale[1]};
  if (!a.exposure_jump.empty()) {
    faults.exposure_jump = ExposureJump{.window = {a.exposure_jump[0], a.exposure_jump[1]},
                                        .factor = a.exposure_jump[2]};
  }
  if (!a.time_jump.empty()) faults.time_jump = TimeJump{a.time_jump[0], a.time_jump[1]};
  if (!a.extrinsics_error.empty())
    faults.extrinsics = ExtrinsicsError{a.extrinsics_error[0] * kDegree, a.extrinsics_error[1]};
  if (const auto ok = AddNamedFaults(a, faults); !ok) return tl::unexpected(ok.error());
  return faults;
}

Json ToJson(const Clocks& clocks) {
  Json json = Json::object();
  for (const auto& [sensor, clock] : clocks) {
    json[sensor] = {
        {"offset_s", clock.offset}, {"drift_ppm", clock.drift_ppm}, {"jitter_s", clock.jitter}};
  }
  return json;
}

Json ToJson(const SequenceFaults& faults) {
  Json json = {{"lidar_gap", ToJson(faults.lidar_gap)},
               {"imu_gap", ToJson(faults.imu_gap)},
               {"empty_sweeps", ToJson(faults.empty_sweeps)},
               {"nan_points", ToJson(faults.nan_points)},
               {"corrupted_sweeps", ToJson(faults.corrupted_sweeps)},
               {"nan_imu", ToJson(faults.nan_imu)},
               {"corrupted_imu", ToJson(faults.corrupted_imu)},
               {"imu_saturation", nullptr},
               {"image_gap", ToJson(faults.image_gap)},
               {"cameras", CamerasJson(faults)},
               {"lens_patches", Json::array()},
               {"exposure_jump", nullptr},
               {"lights_off", ToJson(faults.lights_off)},
               {"triggers_s", faults.triggers},
               {"time_jump", nullptr},
               {"clocks", ToJson(faults.clocks)},
               {"extrinsics_error", nullptr},
               {"imu_in_g", faults.imu_in_g}};
  if (const auto& limits = faults.imu_saturation) {
    json["imu_saturation"] = {{"acceleration_m_s2", limits->acceleration},
                              {"rate_rad_s", limits->rate}};
  }
  for (const LensPatch& patch : faults.lens_patches) {
    json["lens_patches"].push_back(
        {{"camera", patch.camera}, {"u", patch.u}, {"v", patch.v}, {"radius", patch.radius}});
  }
  if (const auto& jump = faults.exposure_jump) {
    json["exposure_jump"] = {{"start_s", jump->window.start},
                             {"length_s", jump->window.length},
                             {"factor", jump->factor}};
  }
  if (faults.time_jump) {
    json["time_jump"] = {{"start_s", faults.time_jump->start}, {"back_s", faults.time_jump->back}};
  }
  if (const auto& error = faults.extrinsics) {
    json["extrinsics_error"] = {{"rotation_deg", error->rotation / kDegree},
                                {"translation_m", error->translation}};
  }
  return json;
}

}  // namespace mlvi

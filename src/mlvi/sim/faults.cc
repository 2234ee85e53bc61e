// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/faults.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mlvi/base/config.h"

namespace mlvi {
namespace {

Eigen::Vector3d RandomDirection(RandomStream& random) {
  const double x = random.Normal(), y = random.Normal(), z = random.Normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

// Mean of the pixels within `reach` of a pixel, as they were before.
double BoxMean(const std::vector<std::uint8_t>& pixels, int width, int height, int channels, int x,
               int y, int channel, int reach) {
  double sum = 0.0;
  int count = 0;
  for (int j = std::max(0, y - reach); j <= std::min(height - 1, y + reach); ++j) {
    for (int i = std::max(0, x - reach); i <= std::min(width - 1, x + reach); ++i, ++count)
      sum += pixels[static_cast<std::size_t>((j * width + i) * channels + channel)];
  }
  return sum / count;
}

Expected<void> CheckName(const std::string& name, const std::vector<std::string>& known,
                         const char* what) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return {};
  return MakeError(ErrorKind::kConfiguration,
                   "a fault of {} '{}', which this rig does not have; did you mean '{}'?", what,
                   name, known.empty() ? "none: it has no camera" : NearestName(name, known));
}

}  // namespace

void SpoilTenth(LidarSweep& sweep, RandomStream random) {
  for (LidarPoint& point : sweep.points) {
    if (random.Uniform() < 0.1) point.position.setConstant(std::numeric_limits<float>::quiet_NaN());
  }
}

Duration ClockFault(const SequenceFaults& faults, const std::string& sensor, double seconds) {
  const auto found = faults.clocks.find(sensor);
  if (found == faults.clocks.end()) return Duration();
  return Duration::FromSeconds(found->second.offset + 1e-6 * found->second.drift_ppm * seconds);
}

std::optional<CameraFailure> FailureOf(const SequenceFaults& faults, const std::string& camera,
                                       double seconds) {
  for (const CameraFault& fault : faults.cameras) {
    if (fault.camera == camera && fault.window.Contains(seconds)) return fault.failure;
  }
  return std::nullopt;
}

void SmearLens(const LensPatch& patch, int channels, Image& image) {
  const std::vector<std::uint8_t> before = image.pixels;
  const double u = patch.u * image.width, v = patch.v * image.height,
               radius = patch.radius * image.width;
  const int reach = std::max(1, static_cast<int>(0.15 * radius));
  for (int y = std::max(0, static_cast<int>(v - radius));
       y < std::min(image.height, static_cast<int>(v + radius) + 1); ++y) {
    for (int x = std::max(0, static_cast<int>(u - radius));
         x < std::min(image.width, static_cast<int>(u + radius) + 1); ++x) {
      const double share = std::hypot(x - u, y - v) / radius;
      if (share >= 1.0) continue;
      const double strength = std::min(1.0, 2.0 * (1.0 - share));
      for (int channel = 0; channel < channels; ++channel) {
        const auto index = static_cast<std::size_t>((y * image.width + x) * channels + channel);
        const double smear =
            0.5 * BoxMean(before, image.width, image.height, channels, x, y, channel, reach);
        image.pixels[index] = static_cast<std::uint8_t>(
            std::lround((1.0 - strength) * before[index] + strength * smear));
      }
    }
  }
}

void DisturbExtrinsics(const ExtrinsicsError& error, RandomStream random, Rig& rig) {
  const auto disturb = [&](Pose3& T_body_sensor) {
    const Eigen::Vector3d turn = error.rotation * RandomDirection(random);
    const Eigen::Vector3d shift = error.translation * RandomDirection(random);
    T_body_sensor =
        Pose3(T_body_sensor.rotation() * ExpSo3(turn), T_body_sensor.translation() + shift);
  };
  if (rig.lidar) disturb(rig.lidar->T_body_lidar);
  for (CameraSpec& camera : rig.cameras) disturb(camera.T_body_camera);
}

Expected<void> CheckFaults(const SequenceFaults& faults, const Rig& rig) {
  const std::vector<std::string> cameras = rig.CameraNames();
  for (const CameraFault& fault : faults.cameras) {
    if (const auto ok = CheckName(fault.camera, cameras, "camera"); !ok) return ok;
  }
  for (const LensPatch& patch : faults.lens_patches) {
    if (const auto ok = CheckName(patch.camera, cameras, "camera"); !ok) return ok;
    if (patch.radius <= 0.0) {
      return MakeError(ErrorKind::kConfiguration, "a lens patch of radius {}; it must be positive",
                       patch.radius);
    }
  }
  std::vector<std::string> sensors = cameras;
  sensors.insert(sensors.end(), {"imu", "lidar"});
  for (const auto& [sensor, clock] : faults.clocks) {
    if (const auto ok = CheckName(sensor, sensors, "the clock of"); !ok) return ok;
  }
  if (faults.imu_saturation &&
      (faults.imu_saturation->acceleration <= 0.0 || faults.imu_saturation->rate <= 0.0)) {
    return MakeError(ErrorKind::kConfiguration,
                     "an IMU that saturates at {} m/s^2 and {} rad/s; both must be positive",
                     faults.imu_saturation->acceleration, faults.imu_saturation->rate);
  }
  return {};
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/faults.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mlvi/base/suggestion.h"
#include "mlvi/sim/random_direction.h"

namespace mlvi {
namespace {

// Means over boxes of an image's pixels, by sums over all that is above and left of a pixel.
class BoxMeans {
 public:
  BoxMeans(const Image& image, int channels)
      : width_(image.width),
        height_(image.height),
        channels_(channels),
        sums_(Index(0, height_ + 1)) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (int c = 0; c < channels; ++c) {
          const auto pixel = static_cast<std::size_t>((y * width_ + x) * channels + c);
          sums_[Index(x + 1, y + 1) + c] = sums_[Index(x, y + 1) + c] + sums_[Index(x + 1, y) + c] -
                                           sums_[Index(x, y) + c] + image.pixels[pixel];
        }
      }
    }
  }

  // Of the pixels within `reach` of a pixel, as far as there are some.
  double At(int x, int y, int channel, int reach) const {
    const int left = std::max(0, x - reach), right = std::min(width_, x + reach + 1);
    const int top = std::max(0, y - reach), bottom = std::min(height_, y + reach + 1);
    const auto at = [&](int i, int j) { return sums_[Index(i, j) + channel]; };
    const std::int64_t sum = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
    return static_cast<double>(sum) / ((right - left) * (bottom - top));
  }

 private:
  std::size_t Index(int x, int y) const {
    return static_cast<std::size_t>((y * (width_ + 1) + x) * channels_);
  }

  int width_, height_, channels_;
  std::vector<std::int64_t> sums_;  // a row and a column of zeros more than the image
};

// Collects the first violation, so that a list of checks reads as a list.
class FaultChecks {
 public:
  void Range(const std::string& what, double value, double least, double most, const char* unit) {
    if (value >= least && value <= most) return;  // so that NaN is none
    Fail(fmt::format("{} is {} {}; it must be in [{:g}, {:g}]", what, value, unit, least, most));
  }
  void Positive(const std::string& what, double value, double most, const char* unit) {
    if (value > 0.0 && value <= most) return;
    Fail(fmt::format("{} is {} {}; it must be positive and at most {:g}", what, value, unit, most));
  }
  void Window(const std::string& what, const std::optional<FaultWindow>& window) {
    if (!window) return;
    Range("the start of " + what, window->start, 0.0, kLongest, "s");
    Range("the length of " + what, window->length, 0.0, kLongest, "s");
  }
  void Name(const std::string& name, const std::vector<std::string>& known, const char* what) {
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    Fail(fmt::format("a fault of {} '{}', which this rig does not have: it has {}{}", what, name,
                     known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", ")),
                     DidYouMean(name, known)));
  }
  void Happens(const std::string& what, const std::optional<FaultWindow>& window, double seconds) {
    if (window) Starts(what, window->start, seconds);
  }
  void Starts(const std::string& what, double start, double seconds) {
    if (start < seconds) return;
    Fail(fmt::format("{} would start after {} s, but the recording ends after {} s", what, start,
                     seconds));
  }
  void TakesImages(const std::string& what, const std::string& camera,
                   const std::vector<std::string>& cameras) {
    if (std::ranges::find(cameras, camera) != cameras.end()) return;
    Fail(fmt::format(
        "{} camera '{}', which takes no images: {}", what, camera,
        cameras.empty() ? "no camera does" : fmt::format("only {} do", fmt::join(cameras, ", "))));
  }
  void NeedsImages(const std::string& what, bool ordered, const std::vector<std::string>& cameras) {
    if (ordered && cameras.empty()) Fail(what + " would change images, but no camera takes any");
  }
  const Expected<void>& result() const { return result_; }

  static constexpr double kLongest = 86400.0;  // s, as recordings

 private:
  void Fail(std::string message) {
    if (result_) result_ = tl::unexpected(Error{ErrorKind::kConfiguration, std::move(message)});
  }
  Expected<void> result_;
};

void CheckLensPatch(const LensPatch& patch, const std::vector<std::string>& cameras,
                    FaultChecks& checks) {
  checks.Name(patch.camera, cameras, "camera");
  checks.Range("u of a lens patch", patch.u, 0.0, 1.0, "of the width");
  checks.Range("v of a lens patch", patch.v, 0.0, 1.0, "of the height");
  checks.Positive("the radius of a lens patch", patch.radius, 1.0, "of the width");
}

constexpr double kFarthest = 5e8;  // s, 16 years: stamps stay after 1970, jump and offset together

void CheckTimeJump(const TimeJump& jump, FaultChecks& checks) {
  checks.Range("the start of the time jump", jump.start, 0.0, FaultChecks::kLongest, "s");
  checks.Range("the time jump", jump.back, -kFarthest, kFarthest, "s");
}

// s between measurements.
double PeriodOf(const std::string& sensor, const Rig& rig, double image_rate) {
  if (sensor == "imu") return 1.0 / rig.imu.rate_hz;
  if (sensor == "lidar" && rig.lidar) return 1.0 / rig.lidar->rate_hz;
  for (const CameraSpec& camera : rig.cameras) {
    if (camera.name == sensor) return 1.0 / (image_rate > 0.0 ? image_rate : camera.rate_hz);
  }
  return 0.0;
}

}  // namespace

void SpoilSample(ImuSample& sample) {
  sample.linear_acceleration.setConstant(std::numeric_limits<double>::quiet_NaN());
  sample.angular_velocity = sample.linear_acceleration;
}

void SpoilTenth(LidarSweep& sweep, RandomStream random) {
  for (LidarPoint& point : sweep.points) {
    if (random.Uniform() < 0.1) point.position.setConstant(std::numeric_limits<float>::quiet_NaN());
  }
}

Duration StampError(const Clocks& clocks, const std::string& sensor, double seconds,
                    RandomStream random) {
  const auto found = clocks.find(sensor);
  if (found == clocks.end()) return Duration();
  const auto& [offset, drift_ppm, jitter] = found->second;
  return Duration::FromSeconds(offset + 1e-6 * drift_ppm * seconds + jitter * random.Uniform());
}

double MeanStampError(const Clocks& clocks, const std::string& sensor, double seconds) {
  const auto found = clocks.find(sensor);
  if (found == clocks.end()) return 0.0;
  const ClockError& clock = found->second;
  return clock.offset + 1e-6 * clock.drift_ppm * seconds + 0.5 * clock.jitter;
}

double TrueSeconds(const Clocks& clocks, const std::string& sensor, double shown) {
  const auto found = clocks.find(sensor);
  if (found == clocks.end()) return shown;
  const ClockError& clock = found->second;
  return (shown - clock.offset - 0.5 * clock.jitter) / (1.0 + 1e-6 * clock.drift_ppm);
}

std::optional<CameraFailure> FailureOf(const SequenceFaults& faults, const std::string& camera,
                                       double seconds) {
  for (const CameraFault& fault : faults.cameras) {
    if (fault.camera == camera && fault.window.Contains(seconds)) return fault.failure;
  }
  return std::nullopt;
}

void SmearLens(const LensPatch& patch, int channels, Image& image) {
  const BoxMeans means(image, channels);
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
        const double smear = 0.5 * means.At(x, y, channel, reach);
        image.pixels[index] = static_cast<std::uint8_t>(
            std::lround((1.0 - strength) * image.pixels[index] + strength * smear));
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

Clocks EffectiveClocks(Clocks clocks, const SequenceFaults& faults) {
  for (const auto& [sensor, clock] : faults.clocks) clocks[sensor] = clock;
  return clocks;
}

Duration TriggerDelay(const SequenceFaults& faults, const std::string& camera) {
  const auto delay = faults.triggers.find(camera);
  return delay == faults.triggers.end() ? Duration() : Duration::FromSeconds(delay->second);
}

Expected<void> CheckClocks(const Clocks& clocks, const Rig& rig, double image_rate) {
  FaultChecks checks;
  std::vector<std::string> sensors = rig.CameraNames();
  sensors.insert(sensors.end(), {"imu", "lidar"});
  for (const auto& [sensor, clock] : clocks) {
    checks.Name(sensor, sensors, "the clock of");
    checks.Range("the offset of the clock of " + sensor, clock.offset, -kFarthest, kFarthest, "s");
    checks.Range("the drift of the clock of " + sensor, clock.drift_ppm, -1e5, 1e5, "ppm");
    checks.Range("the jitter of the clock of " + sensor, clock.jitter, 0.0,
                 PeriodOf(sensor, rig, image_rate) * (1.0 + 1e-6 * clock.drift_ppm), "s");
  }
  return checks.result();
}

ImuErrors EffectiveErrors(ImuErrors errors, const SequenceFaults& faults) {
  if (faults.imu_vibration) errors.vibration = *faults.imu_vibration;
  if (faults.imu_warm_up) errors.warm_up = *faults.imu_warm_up;
  if (faults.imu_sensitivity) errors.sensitivity = *faults.imu_sensitivity;
  return errors;
}

Expected<void> CheckImuErrors(const ImuErrors& errors) {
  FaultChecks checks;
  const auto& [vibration, warm_up, sensitivity] = errors;
  checks.Range("the acceleration of the IMU's vibration", vibration.acceleration, 0.0, 100.0,
               "m/s^2");
  checks.Range("the rate of the IMU's vibration", vibration.rate, 0.0, 10.0, "rad/s");
  checks.Positive("the lowest frequency of the IMU's vibration", vibration.lowest, 1e4, "Hz");
  checks.Range("the highest frequency of the IMU's vibration", vibration.highest, vibration.lowest,
               1e4, "Hz");
  checks.Range("what the accelerometer's bias moves by while warming up", warm_up.accelerometer,
               0.0, 10.0, "m/s^2");
  checks.Range("what the gyroscope's bias moves by while warming up", warm_up.gyroscope, 0.0, 1.0,
               "rad/s");
  checks.Positive("the time constant of the IMU's warm-up", warm_up.time_constant,
                  FaultChecks::kLongest, "s");
  checks.Range("the error of the accelerometer's scale", sensitivity.accelerometer, 0.0, 0.2,
               "(a share: 0.01 is 1 %)");
  checks.Range("the error of the gyroscope's scale", sensitivity.gyroscope, 0.0, 0.2,
               "(a share: 0.01 is 1 %)");
  return checks.result();
}

Expected<void> CheckFaults(const SequenceFaults& faults, const Rig& rig) {
  const std::vector<std::string> cameras = rig.CameraNames();
  FaultChecks checks;
  checks.Window("the LiDAR gap", faults.lidar_gap);
  checks.Window("the empty sweeps", faults.empty_sweeps);
  checks.Window("the NaN points", faults.nan_points);
  checks.Window("the corrupted sweeps", faults.corrupted_sweeps);
  checks.Window("the IMU gap", faults.imu_gap);
  checks.Window("the NaN IMU samples", faults.nan_imu);
  checks.Window("the corrupted IMU messages", faults.corrupted_imu);
  checks.Window("the image gap", faults.image_gap);
  checks.Window("the lights off", faults.lights_off);
  if (const auto& limits = faults.imu_saturation) {
    checks.Positive("the acceleration at which the IMU saturates", limits->acceleration, 1e5,
                    "m/s^2");
    checks.Positive("the rate at which the IMU saturates", limits->rate, 1e4, "rad/s");
  }
  for (const CameraFault& fault : faults.cameras) {
    checks.Name(fault.camera, cameras, "camera");
    checks.Window("the failure of camera " + fault.camera, fault.window);
  }
  for (const LensPatch& patch : faults.lens_patches) CheckLensPatch(patch, cameras, checks);
  for (const auto& [camera, delay] : faults.triggers) {
    checks.Name(camera, cameras, "camera");
    checks.Range("the trigger delay of camera " + camera, delay, 0.0, 1.0, "s");
  }
  if (const auto& jump = faults.exposure_jump) {
    checks.Window("the exposure jump", jump->window);
    checks.Positive("the factor of the exposure jump", jump->factor, 1e3, "times");
  }
  if (faults.time_jump) CheckTimeJump(*faults.time_jump, checks);
  if (const auto& error = faults.extrinsics) {
    checks.Range("the rotation of the extrinsics' error", error->rotation, 0.0, std::numbers::pi,
                 "rad");
    checks.Range("the translation of the extrinsics' error", error->translation, 0.0, 10.0, "m");
  }
  return checks.result();
}

Expected<void> CheckTheyHappen(const SequenceFaults& faults, double seconds,
                               const std::vector<std::string>& cameras) {
  FaultChecks checks;
  checks.Happens("the LiDAR gap", faults.lidar_gap, seconds);
  checks.Happens("the empty sweeps", faults.empty_sweeps, seconds);
  checks.Happens("the NaN points", faults.nan_points, seconds);
  checks.Happens("the corrupted sweeps", faults.corrupted_sweeps, seconds);
  checks.Happens("the IMU gap", faults.imu_gap, seconds);
  checks.Happens("the NaN IMU samples", faults.nan_imu, seconds);
  checks.Happens("the corrupted IMU messages", faults.corrupted_imu, seconds);
  checks.Happens("the image gap", faults.image_gap, seconds);
  checks.Happens("the lights off", faults.lights_off, seconds);
  for (const CameraFault& fault : faults.cameras) {
    checks.Happens("the failure of camera " + fault.camera, fault.window, seconds);
    checks.TakesImages("a failure of", fault.camera, cameras);
  }
  for (const LensPatch& patch : faults.lens_patches)
    checks.TakesImages("a lens patch of", patch.camera, cameras);
  for (const auto& [camera, delay] : faults.triggers)
    checks.TakesImages("a trigger of", camera, cameras);
  for (const auto& [sensor, clock] : faults.clocks) {
    if (sensor != "imu" && sensor != "lidar") checks.TakesImages("a clock of", sensor, cameras);
  }
  if (const auto& jump = faults.exposure_jump)
    checks.Happens("the exposure jump", jump->window, seconds);
  if (faults.time_jump) checks.Starts("the time jump", faults.time_jump->start, seconds);
  checks.NeedsImages("the image gap", faults.image_gap.has_value(), cameras);
  checks.NeedsImages("the lights off", faults.lights_off.has_value(), cameras);
  checks.NeedsImages("the exposure jump", faults.exposure_jump.has_value(), cameras);
  return checks.result();
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/rest_detector.h"

#include <cmath>

namespace mlvi {
namespace {

// Scatter up to so many sigmas of white noise is noise.
constexpr double kNoiseSigmas = 2.0;

const PanoramicObservation* ObservationIn(const Track& track, FrameId frame) {
  for (const TrackObservation& o : track.observations) {
    if (o.frame == frame) return &o.observation;
  }
  return nullptr;
}

bool ViewIsStill(const TrackStore& tracks, FrameId earlier, FrameId now, const RestConfig& config) {
  int common = 0, still = 0;
  for (const Track& track : tracks.tracks()) {
    if (track.last_frame() != now) continue;
    const PanoramicObservation* before = ObservationIn(track, earlier);
    if (before == nullptr || before->camera != track.last().camera) continue;
    ++common;
    if ((track.last().pixel - before->pixel).norm() <= config.max_motion_px) ++still;
  }
  return common >= config.min_tracks && still >= config.min_share * common;
}

// Root mean square per axis about the mean.
template <typename Value>
double Scatter(std::span<const ImuSample> samples, const Value& value) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const ImuSample& s : samples) mean += value(s) / static_cast<double>(samples.size());
  double sum = 0.0;
  for (const ImuSample& s : samples) sum += (value(s) - mean).squaredNorm();
  return std::sqrt(sum / (3.0 * static_cast<double>(samples.size())));
}

bool ImuIsStill(std::span<const ImuSample> samples, const ImuSpec& imu, const RestConfig& config) {
  if (samples.size() < 3) return false;
  const double noise = kNoiseSigmas * std::sqrt(imu.rate_hz);
  const double acceleration =
      Scatter(samples, [](const ImuSample& s) { return s.linear_acceleration; });
  const double rate = Scatter(samples, [](const ImuSample& s) { return s.angular_velocity; });
  return acceleration <= config.max_acceleration + noise * imu.noise.accelerometer_density &&
         rate <= config.max_angular_rate + noise * imu.noise.gyroscope_density;
}

}  // namespace

void RestConfig::Declare(ConfigDeclaration& d) {
  d.Field("enabled", enabled, "Tell the window when the rig stands still");
  d.Field("seconds", seconds, "s", "For which nothing must have moved", {0.1, 10.0});
  d.Field("max_motion_px", max_motion_px, "px",
          "Farthest that a track at rest is from where it was", {0.01, 10.0});
  d.Field("min_share", min_share, "", "Of the tracks, which must be at rest; others may be people",
          {0.5, 1.0});
  d.Field("min_tracks", min_tracks, "", "Fewer tracks tell nothing", {1.0, 1000.0});
  d.Field("max_acceleration", max_acceleration, "m/s^2",
          "Scatter of the accelerometer beyond its noise, root mean square per axis", {0.0, 10.0});
  d.Field("max_angular_rate", max_angular_rate, "rad/s",
          "Scatter of the gyroscope beyond its noise, root mean square per axis", {0.0, 1.0});
  d.Field("velocity_sigma", velocity_sigma, "m/s",
          "How slow a rig that seems to stand still may be, one sigma per axis", {1e-4, 1.0});
}

bool IsAtRest(const TrackStore& tracks, FrameId earlier, FrameId now,
              std::span<const ImuSample> between, const ImuSpec& imu, const RestConfig& config) {
  return config.enabled && ImuIsStill(between, imu, config) &&
         ViewIsStill(tracks, earlier, now, config);
}

}  // namespace mlvi

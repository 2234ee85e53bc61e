// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/visual_inertial_start.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/geometry/so3.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/vio/visual_inertial_alignment.h"

namespace mlvi {
namespace {

using inertial_index::kGravity;
using inertial_index::kSize;
using inertial_index::kVelocity;

constexpr int kFewestViews = 3;
// Bias change of the gyroscope that first-order correction of the path does not carry well.
constexpr double kBiasStep = 1e-3;  // rad/s
constexpr int kMaxPaths = 4;

// Images nearer to an instant of the path than this are taken as of it.
constexpr Duration kTogether = Duration::FromNanoseconds(500'000);

// When the image of a camera was taken.
Time TakenAt(const StartData& data, const FrameInstant& frame, std::size_t camera) {
  const Duration delay = camera < frame.delays.size() ? frame.delays[camera] : Duration();
  const double offset = camera < data.time_offsets.size() ? data.time_offsets[camera] : 0.0;
  return frame.stamp + delay + Duration::FromSeconds(offset);
}

// Of ascending instants, at least one, that which `time` belongs to; empty when it is of none.
std::optional<std::size_t> InstantAt(std::span<const Time> instants, Time time) {
  auto nearest = std::lower_bound(instants.begin(), instants.end(), time);
  if (nearest == instants.end() ||
      (nearest != instants.begin() && time - *std::prev(nearest) < *nearest - time)) {
    --nearest;
  }
  const Duration apart = *nearest - time;
  if (apart >= kTogether || -apart >= kTogether) return std::nullopt;
  return static_cast<std::size_t>(nearest - instants.begin());
}

// The stamps of all frames, and the instants of their images as far as the IMU covers them: those
// of the last set may be taken after all samples, those of the first one before its stamp.
std::vector<Time> InstantsOf(const StartData& data) {
  std::vector<Time> instants;
  for (const FrameInstant& frame : data.frames) instants.push_back(frame.stamp);
  for (const FrameInstant& frame : data.frames) {
    const std::size_t cameras = std::max(frame.delays.size(), data.time_offsets.size());
    for (std::size_t camera = 0; camera < cameras; ++camera) {
      const Time taken = TakenAt(data, frame, camera);
      if (taken < data.frames.front().stamp || taken > data.samples.back().stamp) continue;
      if (InstantAt(instants, taken)) continue;
      instants.insert(std::upper_bound(instants.begin(), instants.end(), taken), taken);
    }
  }
  return instants;
}

std::vector<internal::FeatureViews> ViewsWithin(const StartData& data,
                                                std::span<const Time> instants) {
  std::vector<internal::FeatureViews> features;
  for (const Track& track : data.tracks) {
    internal::FeatureViews views;
    for (const TrackObservation& seen : track.observations) {
      const auto frame =
          std::lower_bound(data.frames.begin(), data.frames.end(), seen.frame,
                           [](const FrameInstant& f, const FrameId& id) { return f.id < id; });
      if (frame == data.frames.end() || frame->id != seen.frame) continue;
      const auto camera = static_cast<std::size_t>(seen.observation.camera);
      if (const auto instant = InstantAt(instants, TakenAt(data, *frame, camera)))
        views.push_back({*instant, seen.observation});
    }
    if (static_cast<int>(views.size()) >= kFewestViews) features.push_back(std::move(views));
  }
  return features;
}

// Median over features of how far they moved in the image, in px, if the body did not turn.
double MedianMotion(std::span<const internal::FeatureViews> features) {
  std::vector<double> motions;
  for (const internal::FeatureViews& views : features) {
    const PanoramicObservation& a = views.front().observation;
    motions.push_back(
        (a.pixel_per_bearing * (views.back().observation.bearing - a.bearing)).norm());
  }
  const auto middle = motions.begin() + static_cast<std::ptrdiff_t>(motions.size() / 2);
  std::nth_element(motions.begin(), middle, motions.end());
  return *middle;
}

Expected<void> CheckCoverage(const StartData& data, const VisualInertialStartConfig& config) {
  const double seconds =
      data.frames.empty() ? 0.0 : (data.frames.back().stamp - data.frames.front().stamp).seconds();
  if (seconds < config.min_seconds) {
    return MakeError(ErrorKind::kEstimation,
                     "a visual start needs images over {:.1f} s, got {:.2f} s", config.min_seconds,
                     seconds);
  }
  if (data.samples.empty() || data.samples.front().stamp > data.frames.front().stamp ||
      data.samples.back().stamp < data.frames.back().stamp) {
    return MakeError(
        ErrorKind::kEstimation,
        "the IMU does not cover the images from {} to {}; it paused, or a clock offset "
        "(time_offset of imu or cameras) is wrong",
        ToString(data.frames.front().stamp), ToString(data.frames.back().stamp));
  }
  return {};
}

Expected<void> CheckTracks(const StartData& data, std::size_t tracks,
                           const VisualInertialStartConfig& config) {
  if (static_cast<int>(tracks) >= config.min_tracks) return {};
  return MakeError(ErrorKind::kEstimation,
                   "a visual start needs {} tracks, got {} in {:.1f} s: dark, bare or blurred "
                   "images, or masks that leave too little",
                   config.min_tracks, tracks,
                   (data.frames.back().stamp - data.frames.front().stamp).seconds());
}

// The state at rest, at every frame.
Initialization RestAt(const Initialization& rest, std::span<const FrameInstant> frames) {
  Initialization start = rest;
  start.states.assign(frames.size(), rest.states.back());
  for (std::size_t k = 0; k < frames.size(); ++k) start.states[k].stamp = frames[k].stamp;
  return start;
}

struct Alignment {
  internal::RefinedAlignment refined;
  InertialPath::Excitation excitation;
};

Alignment Align(const StartData& data, std::span<const Time> instants,
                const internal::AlignmentData& features, const ImuSpec& imu, double gravity) {
  ImuBias bias;
  InertialPath path(instants, data.samples, bias, imu);
  internal::RefinedAlignment refined = internal::RefineAlignment(
      features, path, internal::AlignTracks(features, path, bias, gravity), imu);
  for (int i = 1; i < kMaxPaths; ++i) {
    const ImuBias& estimate = refined.alignment.unknowns.bias;
    if ((estimate.gyroscope - bias.gyroscope).norm() < kBiasStep) break;
    bias = estimate;
    path = InertialPath(instants, data.samples, bias, imu);
    refined = internal::RefineAlignment(features, path, refined.alignment, imu);
  }
  return {.refined = refined, .excitation = path.FindExcitation(imu.noise, gravity)};
}

double LargestSigma(const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(eigen.eigenvalues().maxCoeff(), 0.0));
}

// Why the alignment is no start; empty when it is one.
std::string Objection(const Alignment& alignment, double scale,
                      const VisualInertialStartConfig& config) {
  const internal::RefinedAlignment& refined = alignment.refined;
  if (!(refined.rms <= config.max_rms)) {
    return fmt::format(
        "tracks and IMU contradict each other: bearings miss by {:.1f} sigma (limit {:.1f}), "
        "{:.0f} % within three; check the extrinsics of cameras and IMU, time_offset of the "
        "cameras, "
        "lens models and the unit of acceleration",
        refined.rms, config.max_rms, 100.0 * refined.inlier_share);
  }
  const InertialPath::Excitation& excitation = alignment.excitation;
  if (!(excitation.ScaleSigma() <= config.max_scale_sigma)) {
    return fmt::format(
        "the motion does not show the scale yet: the IMU sees {:.4f} m (rms) that steady motion "
        "does "
        "not explain, and its noise alone would be {:.4f} m (limit {:.2f} of it); speeding up, "
        "turning or standing still would show it",
        excitation.path, excitation.noise, config.max_scale_sigma);
  }
  const double velocity =
      scale * LargestSigma(refined.covariance.block<3, 3>(kVelocity, kVelocity));
  const double tilt = scale * LargestSigma(refined.covariance.block<2, 2>(kGravity, kGravity));
  if (!(velocity <= config.max_velocity_sigma) || !(tilt <= config.max_tilt_sigma)) {
    return fmt::format(
        "the motion does not show velocity and gravity yet: known to {:.2f} m/s and {:.1f} deg "
        "(limits {:.2f} m/s, {:.1f} deg); speeding up, turning or standing still would",
        velocity, tilt * 180.0 / std::numbers::pi, config.max_velocity_sigma,
        config.max_tilt_sigma * 180.0 / std::numbers::pi);
  }
  return {};
}

// Derivative of the rotation R_world_first (right perturbation) by that of gravity: level, with the
// heading of the first body kept.
Eigen::Matrix<double, 3, 2> LevelDerivative(const Eigen::Quaterniond& R_world_first,
                                            const Eigen::Vector3d& gravity) {
  const Eigen::Matrix<double, 3, 2> tilt =
      -Hat(gravity) * GravityTangent(gravity) / gravity.squaredNorm();
  const Eigen::RowVector3d heading = Heading(-gravity).Derivative(R_world_first.toRotationMatrix());
  return tilt - gravity * (heading * tilt) / heading.dot(gravity);
}

// Covariance of the last state, and of the gauge.
Matrix15d LastCovariance(const InertialPath& path, const internal::VisualInertialAlignment& at,
                         const Eigen::Quaterniond& R_world_first,
                         const internal::AlignmentMatrix& covariance) {
  using nav_index::kPosition, nav_index::kRotation;
  const InertialPath::Step step = path.At(path.size() - 1, at.unknowns, at.disturbances.back());
  const Eigen::Matrix3d R = R_world_first.toRotationMatrix();
  const Eigen::Matrix3d R_first_body = step.T_first_body.R();
  Eigen::Matrix<double, 3, kSize> turn = Eigen::Matrix<double, 3, kSize>::Zero();
  turn.middleCols<2>(kGravity) = LevelDerivative(R_world_first, at.unknowns.gravity);
  Eigen::Matrix<double, 15, internal::kAlignmentSize> J =
      Eigen::Matrix<double, 15, internal::kAlignmentSize>::Zero();
  J.block<3, kSize>(kPosition, 0) =
      R * (R_first_body * step.d_pose.topRows<3>() - Hat(step.T_first_body.translation()) * turn);
  J.block<3, kSize>(nav_index::kVelocity, 0) = R * (step.d_velocity - Hat(step.velocity) * turn);
  J.block<3, kSize>(kRotation, 0) = step.d_pose.bottomRows<3>() + R_first_body.transpose() * turn;
  J.block<3, 3>(nav_index::kAccelerometerBias, inertial_index::kAccelerometerBias).setIdentity();
  J.block<3, 3>(nav_index::kGyroscopeBias, inertial_index::kGyroscopeBias).setIdentity();
  J.block<3, 3>(kPosition, kSize + kPosition) = R;
  J.block<3, 3>(nav_index::kVelocity, kSize + nav_index::kVelocity) = R;
  J.block<3, kDisturbanceSize>(kRotation, kSize) = step.d_disturbance.bottomRows<3>();
  Matrix15d result = J * covariance * J.transpose();
  result.diagonal().segment<3>(kPosition).array() += kGaugePositionSigma * kGaugePositionSigma;
  const Eigen::Vector3d up = (R * R_first_body).transpose().col(2);
  result.block<3, 3>(kRotation, kRotation) +=
      kGaugeHeadingSigma * kGaugeHeadingSigma * up * up.transpose();
  return result;
}

// The biases that are found are those of the middle of the path.
Matrix15d BiasWalk(const ImuNoise& noise, double seconds) {
  const auto variance = [seconds](double walk) { return walk * walk * seconds / 3.0; };
  Matrix15d result = Matrix15d::Zero();
  result.diagonal()
      .segment<3>(nav_index::kAccelerometerBias)
      .setConstant(variance(noise.accelerometer_random_walk));
  result.diagonal()
      .segment<3>(nav_index::kGyroscopeBias)
      .setConstant(variance(noise.gyroscope_random_walk));
  return result;
}

Initialization StatesOf(const StartData& data, std::span<const Time> instants,
                        const internal::RefinedAlignment& refined, double scale,
                        const ImuSpec& imu) {
  const InertialUnknowns& unknowns = refined.alignment.unknowns;
  const InertialPath path(instants, data.samples, unknowns.bias, imu);
  const Eigen::Quaterniond R_world_first = LevelRotation(-unknowns.gravity);
  const Pose3 T_world_first(R_world_first, Eigen::Vector3d::Zero());
  Initialization start{.method = "visual-inertial", .rms_residual = refined.rms};
  const std::vector<InertialPath::Step> steps =
      path.Steps(unknowns, refined.alignment.disturbances);
  for (const FrameInstant& frame : data.frames) {
    const InertialPath::Step& step = steps[*InstantAt(instants, frame.stamp)];
    start.states.push_back({.stamp = frame.stamp,
                            .T_world_body = T_world_first * step.T_first_body,
                            .v_world_body = R_world_first * step.velocity,
                            .bias = unknowns.bias});
  }
  start.covariance =
      LastCovariance(path, refined.alignment, R_world_first, scale * scale * refined.covariance) +
      BiasWalk(imu.noise, path.Elapsed(path.size() - 1));
  return start;
}

}  // namespace

void VisualInertialStartConfig::Declare(ConfigDeclaration& d) {
  d.Field("min_seconds", min_seconds, "s", "Images over this time are needed for a start",
          {0.5, 30.0});
  d.Field("max_seconds", max_seconds, "s", "Older images do not take part in a start", {0.5, 30.0});
  d.AtMost("min_seconds", "max_seconds", "no visual start ever comes about");
  d.Field("frame_interval", frame_interval, "s", "Of images closer in time some are left out",
          {0.0, 1.0});
  d.Field("retry_interval", retry_interval, "s", "Time between attempts at a start", {0.0, 10.0});
  d.Field("min_tracks", min_tracks, "", "Features seen in at least three of them", {8.0, 10000.0});
  d.Field("rest_motion", rest_motion, "px",
          "Features that move less (median over the time of the start) let the IMU's rest count",
          {0.1, 10.0});
  d.Field(
      "max_scale_sigma", max_scale_sigma, "",
      "A moving start waits until the IMU's noise is at most this share of the motion that shows "
      "scale",
      {0.01, 1.0});
  d.Field("max_velocity_sigma", max_velocity_sigma, "m/s",
          "A moving start waits until the velocity is known to this", {0.001, 10.0});
  d.Field("max_tilt_sigma", max_tilt_sigma, "rad",
          "A moving start waits until the direction of gravity is known to this", {1e-4, 0.5});
  d.Field("max_rms", max_rms, "",
          "Bearings that miss the IMU's path by more sigmas (rms) show a wrong calibration",
          {1.0, 100.0});
}

Expected<Initialization> InitializeFromTracks(const StartData& data, const ImuSpec& imu,
                                              double gravity,
                                              const VisualInertialStartConfig& config) {
  if (auto covered = CheckCoverage(data, config); !covered) {
    return tl::unexpected(covered.error());
  }
  const std::vector<Time> instants = InstantsOf(data);
  const std::vector<internal::FeatureViews> features = ViewsWithin(data, instants);
  if (auto enough = CheckTracks(data, features.size(), config); !enough) {
    return tl::unexpected(enough.error());
  }
  std::string no_rest;
  if (MedianMotion(features) < config.rest_motion) {
    const std::vector<ImuSample> samples =
        SamplesBetween(data.samples, data.frames.front().stamp, data.frames.back().stamp);
    if (const auto rest = InitializeAtRest(samples, imu, gravity, &no_rest)) {
      return RestAt(*rest, data.frames);
    }
  }
  const Alignment alignment = Align(
      data, instants,
      {.features = features, .T_body_pano = data.T_body_pano, .pixel_sigma = data.pixel_sigma}, imu,
      gravity);
  // Residuals above what the tracks promise widen the covariance.
  const double scale = std::max(1.0, alignment.refined.rms);
  if (const std::string objection = Objection(alignment, scale, config); !objection.empty()) {
    return MakeError(ErrorKind::kEstimation, "{}{}", objection,
                     no_rest.empty() ? "" : "; no rest, as " + no_rest);
  }
  return StatesOf(data, instants, alignment.refined, scale, imu);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlvi/geometry/so3.h"
#include "mlvi/imu/initialization.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/imu/pose_alignment.h"
#include "mlvi/imu/preintegration.h"
#include "mlvi/imu/refinement.h"

namespace mlvi {
namespace {

constexpr std::size_t kMinimumPoses = 4;
constexpr double kMinimumSeconds = 1.0;
constexpr double kLargestGap = 0.5;  // s without IMU samples
// Whitened residual beyond which poses and IMU contradict each other. Agreement gives 1; turned
// axes, a wrong gravity or a time offset give more than 10.
constexpr double kLargestRms = 6.0;
// No registration of a sweep taken in motion is better than this, whatever its normal equations
// claim.
constexpr double kSmallestStepPosition = 0.005;  // m
constexpr double kSmallestStepRotation = 0.001;  // rad

// The longest time within [from, to] without a sample.
double LongestGap(std::span<const ImuSample> samples, Time from, Time to) {
  Time previous = from;
  double longest = 0.0;
  for (const ImuSample& sample : samples) {
    if (sample.stamp <= from) continue;
    if (sample.stamp >= to) break;
    longest = std::max(longest, (sample.stamp - previous).seconds());
    previous = sample.stamp;
  }
  return std::max(longest, (to - previous).seconds());
}

Expected<void> CheckInput(std::span<const TimedPose> poses, std::span<const ImuSample> samples) {
  if (poses.size() < kMinimumPoses) {
    return MakeError(ErrorKind::kInput, "a moving start needs {} poses, got {}", kMinimumPoses,
                     poses.size());
  }
  for (std::size_t k = 1; k < poses.size(); ++k) {
    MLVI_CHECK(poses[k - 1].stamp < poses[k].stamp,
               "poses must be in strictly ascending order, {} follows {}", ToString(poses[k].stamp),
               ToString(poses[k - 1].stamp));
    MLVI_CHECK(
        poses[k].covariance.allFinite() && poses[k].covariance.llt().info() == Eigen::Success,
        "the covariance of the step to pose {} is not positive definite", k);
  }
  const Time from = poses.front().stamp, to = poses.back().stamp;
  const double seconds = (to - from).seconds();
  if (seconds < kMinimumSeconds) {
    return MakeError(ErrorKind::kInput, "a moving start needs poses over {:.1f} s, got {:.2f} s",
                     kMinimumSeconds, seconds);
  }
  if (samples.empty()) {
    return MakeError(ErrorKind::kInput, "no IMU samples between the poses at {} and {}",
                     ToString(from), ToString(to));
  }
  if (const double gap = LongestGap(samples, from, to); gap > kLargestGap) {
    return MakeError(ErrorKind::kInput,
                     "IMU samples from {} to {} leave {:.2f} s of the poses from {} to {} "
                     "uncovered; the IMU paused or "
                     "its clock differs from that of the poses (imu.time_offset)",
                     ToString(samples.front().stamp), ToString(samples.back().stamp), gap,
                     ToString(from), ToString(to));
  }
  return {};
}

std::vector<PreintegratedImu> PreintegrateBetween(std::span<const TimedPose> poses,
                                                  std::span<const ImuSample> samples,
                                                  const ImuBias& bias, const ImuSpec& imu) {
  std::vector<PreintegratedImu> motions;
  for (std::size_t k = 0; k + 1 < poses.size(); ++k) {
    motions.push_back(
        Preintegrate(SamplesBetween(samples, poses[k].stamp, poses[k + 1].stamp), bias, imu));
  }
  return motions;
}

// `covariance` with its variances raised to the floor.
Matrix6d Floored(Matrix6d covariance) {
  Vector6d floor;
  floor << Eigen::Vector3d::Constant(kSmallestStepPosition),
      Eigen::Vector3d::Constant(kSmallestStepRotation);
  covariance.diagonal() = covariance.diagonal().cwiseMax(floor.cwiseAbs2()).eval();
  return covariance;
}

// States in the levelled world from the closed form.
std::vector<NavState> FirstStates(std::span<const TimedPose> poses,
                                  const internal::PoseAlignment& alignment, const ImuBias& bias) {
  const Pose3& first = poses.front().T_start_body;
  const Eigen::Quaterniond R_world_body =
      LevelRotation(first.rotation().conjugate() * -alignment.gravity);
  const Pose3 T_world_start = Pose3(R_world_body, Eigen::Vector3d::Zero()) * first.inverse();
  std::vector<NavState> states(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    states[k].stamp = poses[k].stamp;
    states[k].T_world_body = T_world_start * poses[k].T_start_body;
    states[k].v_world_body = T_world_start.rotation() * alignment.velocities[k];
    states[k].bias = bias;
  }
  return states;
}

// Largest rotation between what the gyroscope and the poses say of one step, in degrees.
double LargestTurnDifference(std::span<const internal::RelativePose> steps,
                             std::span<const PreintegratedImu> motions) {
  double largest = 0.0;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const Eigen::Quaterniond difference =
        motions[k].delta_R.conjugate() * steps[k].T_from_to.rotation();
    largest = std::max(largest, LogSo3(difference).norm() * 180.0 / std::numbers::pi);
  }
  return largest;
}

}  // namespace

Expected<Initialization> InitializeFromPoses(std::span<const TimedPose> poses,
                                             std::span<const ImuSample> samples, const ImuSpec& imu,
                                             double gravity) {
  if (auto valid = CheckInput(poses, samples); !valid) return tl::unexpected(valid.error());
  std::vector<internal::RelativePose> steps;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    steps.push_back({poses[k - 1].T_start_body.inverse() * poses[k].T_start_body,
                     Floored(poses[k].covariance)});
  }
  // Closed form: first the gyroscope bias, which the rest depends on strongly, then everything
  // else.
  ImuBias bias;
  bias.gyroscope =
      internal::AlignGyroscopeBias(poses, PreintegrateBetween(poses, samples, bias, imu), imu);
  auto motions = PreintegrateBetween(poses, samples, bias, imu);
  const internal::PoseAlignment alignment = internal::AlignGravity(poses, motions, imu, gravity);
  bias.accelerometer = alignment.accelerometer_bias;
  motions = PreintegrateBetween(poses, samples, bias, imu);

  const internal::Refinement refined =
      internal::RefineStates(FirstStates(poses, alignment, bias), motions, steps, imu, gravity);
  const double reduced_chi_square = refined.chi_square / refined.degrees_of_freedom;
  const double rms = std::sqrt(reduced_chi_square);
  if (!(rms <= kLargestRms)) {
    const ImuBias& last = refined.states.back().bias;
    return MakeError(ErrorKind::kEstimation,
                     "poses and IMU contradict each other: whitened residual {:.1f} over {} poses "
                     "in {:.1f} s (limit {:.1f}), turns "
                     "differ by up to {:.1f} deg per step, best biases {:.3f} m/s^2 and {:.4f} "
                     "rad/s; check the rotation between "
                     "LiDAR and IMU, the time offset between them, the unit of acceleration and "
                     "the gravity of {:.3f} m/s^2",
                     rms, poses.size(), (poses.back().stamp - poses.front().stamp).seconds(),
                     kLargestRms, LargestTurnDifference(steps, motions), last.accelerometer.norm(),
                     last.gyroscope.norm(), gravity);
  }
  // Registrations tend to claim too much: a residual above what they promise widens the covariance.
  const double widened = std::max(1.0, reduced_chi_square);
  std::vector<Matrix6d> relative = refined.relative;
  for (Matrix6d& covariance : relative) covariance *= widened;
  return Initialization{.states = refined.states,
                        .covariance = widened * refined.covariance,
                        .relative = std::move(relative),
                        .method = "moving",
                        .rms_residual = rms};
}

}  // namespace mlvi

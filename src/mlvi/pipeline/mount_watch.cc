// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/mount_watch.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "mlvi/geometry/so3.h"
#include "mlvi/imu/preintegration.h"

namespace mlvi {
namespace {

constexpr std::int64_t kEnough = 30;  // sweeps
constexpr double kSignificant = 6.0;  // sigmas of the misalignment
// No step is known better: motion in a plane must not pass for knowledge of the other axes.
constexpr double kStepSigma = 2e-4;  // rad
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

}  // namespace

MountWatch::MountWatch(const Rig& rig, const MountLimits& limits)
    : imu_(rig.imu), range_noise_(rig.lidar ? rig.lidar->range_noise : 0.0), limits_(limits) {}

void MountWatch::Observe(const LioResult& result, std::span<const ImuSample> imu) {
  if (result.estimates.empty()) return;
  const NavState& estimate = result.estimates.back().state;
  if (result.estimates.size() == 1) {  // else a start, which has no map yet
    ++registrations_;
    sum_new_ += result.new_share;
    sum_residual_ += result.rms_residual * result.rms_residual;
  }
  const bool follows = newest_ && !imu.empty() && imu.front().stamp == newest_->stamp &&
                       imu.back().stamp == estimate.stamp;
  if (follows) {
    const Eigen::Vector3d g = LogSo3(Preintegrate(imu, newest_->bias, imu_).delta_R);
    const Eigen::Vector3d l =
        LogSo3(newest_->T_world_body.rotation().conjugate() * estimate.T_world_body.rotation());
    sum_lg_ += l * g.transpose();
    sum_ll_ += l.squaredNorm();
    sum_gg_ += g.squaredNorm();
    ++turns_;
  }
  newest_ = estimate;
}

// The rotation R that minimises sum |l - R g|^2 (Wahba's problem, solved by SVD), and how well it
// is known: about a unit axis a, its information is that of the g perpendicular to a.
std::optional<MountWatch::Misalignment> MountWatch::MeasuredMisalignment() const {
  if (turns_ < kEnough) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum_lg_, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  const double information = svd.singularValues()[1] + svd.singularValues()[2];
  const double residual = sum_ll_ + sum_gg_ - 2.0 * svd.singularValues().dot(signs);
  const double variance =
      std::max(kStepSigma * kStepSigma, residual / (3.0 * static_cast<double>(turns_)));
  return Misalignment{.angle = Eigen::AngleAxisd(R).angle(),
                      .sigma = std::sqrt(variance / std::max(information, 1e-12))};
}

std::string MountWatch::BiasFinding() const {
  const Eigen::Vector3d& a = newest_->bias.accelerometer;
  const Eigen::Vector3d& g = newest_->bias.gyroscope;
  const bool large =
      a.cwiseAbs().maxCoeff() > limits_.bias_sigmas * imu_.initial_accelerometer_bias_sigma ||
      g.cwiseAbs().maxCoeff() > limits_.bias_sigmas * imu_.initial_gyroscope_bias_sigma;
  if (!large) return {};
  return fmt::format(
      "estimated biases of ({:.2f}, {:.2f}, {:.2f}) m/s^2 and ({:.4f}, {:.4f}, {:.4f}) rad/s "
      "exceed "
      "{:g} initial sigmas of the rig ({:g}, {:g}): likely wrong extrinsics (lidar.T_body_lidar) "
      "or "
      "time offset, or sigmas too small in the rig file",
      a.x(), a.y(), a.z(), g.x(), g.y(), g.z(), limits_.bias_sigmas,
      imu_.initial_accelerometer_bias_sigma, imu_.initial_gyroscope_bias_sigma);
}

// A sweep that does not fit the map beside leaves both marks: large residuals where it is matched,
// and much that is not matched at all.
std::string MountWatch::RegistrationFinding() const {
  if (registrations_ < kEnough) return {};
  const double count = static_cast<double>(registrations_);
  const double rms = std::sqrt(sum_residual_ / count), fresh = sum_new_ / count;
  if (rms < limits_.residual * range_noise_ || fresh < limits_.new_share) return {};
  return fmt::format(
      "sweeps fit the map badly: residuals of {:.3f} m rms ({:.1f} range noises), {:.0f} % of the "
      "points are new to "
      "the map: likely wrong extrinsics (lidar.T_body_lidar), or point times that are none",
      rms, rms / range_noise_, 100.0 * fresh);
}

std::vector<std::string> MountWatch::Findings() const {
  std::vector<std::string> findings;
  if (!newest_) return findings;
  const auto add = [&](std::string finding) {
    if (!finding.empty()) findings.push_back(std::move(finding));
  };
  add(BiasFinding());
  const auto turned = MeasuredMisalignment();
  if (turned && turned->angle > limits_.misalignment &&
      turned->angle > kSignificant * turned->sigma && turned->sigma < 0.5 * limits_.misalignment) {
    add(
        fmt::format("rotations by the LiDAR are turned by {:.1f} deg against those by the "
                    "gyroscopes (sigma {:.1f} "
                    "deg): likely a wrong rotation in lidar.T_body_lidar",
                    kDegrees * turned->angle, kDegrees * turned->sigma));
  }
  add(RegistrationFinding());
  return findings;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/filter_state.h"

#include <cmath>

#include "mlvi/imu/propagation.h"

namespace mlvi {
namespace {

using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

// What the first registrations leave unknown about the pose in the map.
constexpr double kAnchorSigmaM = 0.01;
constexpr double kAnchorSigmaRad = 0.002;
// Growth of the tilt's uncertainty: the map bends a little as it grows (rad / sqrt(s)).
constexpr double kTiltWalk = 1e-4;
// The same of the time offset (s / sqrt(s)): free clocks part by some 1e-5, 0.1 ms in ten seconds.
constexpr double kTimeOffsetWalk = 3e-5;

Eigen::Quaterniond TiltRotation(const Eigen::Vector2d& tilt) {
  return ExpSo3(Eigen::Vector3d(tilt.x(), tilt.y(), 0.0));
}

NavState Rotated(const NavState& state, const Eigen::Quaterniond& R) {
  NavState result = state;
  result.T_world_body = Pose3(R, Eigen::Vector3d::Zero()) * state.T_world_body;
  result.v_world_body = R * state.v_world_body;
  return result;
}

template <typename Covariance>
void AddToPose(const Matrix6d& pose, Covariance& covariance) {
  covariance.template block<3, 3>(kPosition, kPosition) += pose.topLeftCorner<3, 3>();
  covariance.template block<3, 3>(kPosition, kRotation) += pose.topRightCorner<3, 3>();
  covariance.template block<3, 3>(kRotation, kPosition) += pose.bottomLeftCorner<3, 3>();
  covariance.template block<3, 3>(kRotation, kRotation) += pose.bottomRightCorner<3, 3>();
}

// The rate at which the state changes while the IMU measures `sample`, in the chart of the error.
Vector15d Rate(const NavState& state, const ImuSample& sample,
               const Eigen::Vector3d& gravity_world) {
  Vector15d rate = Vector15d::Zero();
  rate.segment<3>(kPosition) = state.v_world_body;
  rate.segment<3>(kVelocity) =
      state.T_world_body.rotation() * (sample.linear_acceleration - state.bias.accelerometer) +
      gravity_world;
  rate.segment<3>(kRotation) = sample.angular_velocity - state.bias.gyroscope;
  return rate;
}

// Rotates the world axes of position and velocity.
Matrix15d WorldRotation(const Eigen::Quaterniond& R) {
  Matrix15d result = Matrix15d::Identity();
  result.block<3, 3>(kPosition, kPosition) = R.toRotationMatrix();
  result.block<3, 3>(kVelocity, kVelocity) = R.toRotationMatrix();
  return result;
}

}  // namespace

FilterState BoxPlus(const FilterState& state, const FilterVector& delta) {
  return {.nav = BoxPlus(state.nav, Vector15d(delta.head<15>())),
          .tilt = state.tilt + delta.segment<2>(kTilt),
          .time_offset = state.time_offset + delta(kTimeOffset)};
}

FilterVector BoxMinus(const FilterState& a, const FilterState& b) {
  FilterVector delta;
  delta << BoxMinus(a.nav, b.nav), a.tilt - b.tilt, a.time_offset - b.time_offset;
  return delta;
}

TimeOffset TimeOffsetOf(const StateEstimate& estimate) {
  return {.seconds = estimate.mean.time_offset,
          .sigma = std::sqrt(estimate.covariance(kTimeOffset, kTimeOffset))};
}

StateEstimate AnchorToMap(const NavState& state, const Matrix15d& covariance,
                          const TimeOffset& time_offset) {
  const Eigen::Matrix3d R = state.T_world_body.R();
  Eigen::Matrix<double, kFilterSize, 15> J = Eigen::Matrix<double, kFilterSize, 15>::Zero();
  J.block<3, 3>(kVelocity, kVelocity).setIdentity();
  J.block<3, 3>(kVelocity, kRotation) = Hat(state.v_world_body) * R;
  J.block<6, 6>(9, 9).setIdentity();
  J.block<2, 3>(kTilt, kRotation) = -R.topRows<2>();
  StateEstimate result{.mean = {.nav = state, .time_offset = time_offset.seconds},
                       .covariance = J * covariance * J.transpose()};
  result.covariance(kTimeOffset, kTimeOffset) = time_offset.sigma * time_offset.sigma;
  result.covariance.diagonal().segment<3>(kPosition).array() += kAnchorSigmaM * kAnchorSigmaM;
  result.covariance.diagonal().segment<3>(kRotation).array() += kAnchorSigmaRad * kAnchorSigmaRad;
  return result;
}

Matrix15d ReportedCovariance(const StateEstimate& estimate, const Matrix6d& drift) {
  Eigen::Matrix<double, 15, kFilterSize> J = Eigen::Matrix<double, 15, kFilterSize>::Zero();
  J.leftCols<15>().setIdentity();
  // A world turned by -tilt about its origin.
  const Pose3& T = estimate.mean.nav.T_world_body;
  J.block<3, 2>(kPosition, kTilt) = Hat(T.translation()).leftCols<2>();
  J.block<3, 2>(kVelocity, kTilt) = Hat(estimate.mean.nav.v_world_body).leftCols<2>();
  J.block<3, 2>(kRotation, kTilt) = -T.R().transpose().leftCols<2>();
  FilterMatrix covariance = estimate.covariance;
  covariance.block<2, 2>(kTilt, kTilt) += estimate.mean.tilt * estimate.mean.tilt.transpose();
  Matrix15d result = J * covariance * J.transpose();
  AddPoseCovariance(drift, result);
  return result;
}

Matrix6d PoseCovariance(const FilterMatrix& covariance) {
  Matrix6d result;
  result << covariance.block<3, 3>(kPosition, kPosition),
      covariance.block<3, 3>(kPosition, kRotation), covariance.block<3, 3>(kRotation, kPosition),
      covariance.block<3, 3>(kRotation, kRotation);
  return result;
}

void AddPoseCovariance(const Matrix6d& pose, Matrix15d& covariance) { AddToPose(pose, covariance); }

void AddPoseCovariance(const Matrix6d& pose, FilterMatrix& covariance) {
  AddToPose(pose, covariance);
}

Matrix6d GrownDrift(const Matrix6d& drift, const Pose3& from, const StateEstimate& to,
                    double new_share) {
  const Pose3& T = to.mean.nav.T_world_body;
  Matrix6d F = Matrix6d::Identity();
  F.topRightCorner<3, 3>() = -Hat(T.translation() - from.translation()) * from.R();
  F.bottomRightCorner<3, 3>() = (T.rotation().conjugate() * from.rotation()).toRotationMatrix();
  return F * drift * F.transpose() + new_share * PoseCovariance(to.covariance);
}

Prediction Predict(const StateEstimate& start, std::span<const ImuSample> samples,
                   const ImuSpec& imu, double gravity) {
  const Eigen::Quaterniond R_world_level = TiltRotation(start.mean.tilt);
  const Matrix15d to_world = WorldRotation(R_world_level);
  const Matrix15d P = start.covariance.topLeftCorner<15, 15>();
  const Propagation level = Propagate(Rotated(start.mean.nav, R_world_level.conjugate()),
                                      to_world.transpose() * P * to_world, samples, imu, gravity);
  Prediction result;
  result.trajectory.reserve(level.states.size());
  for (const NavState& state : level.states)
    result.trajectory.push_back(Rotated(state, R_world_level));

  const double dt = (samples.back().stamp - samples.front().stamp).seconds();
  const Eigen::Vector3d gravity_world = R_world_level * Eigen::Vector3d(0.0, 0.0, -gravity);
  const Eigen::Matrix<double, 3, 2> dg_dtilt = -Hat(gravity_world).leftCols<2>();
  const Matrix15d F = to_world * level.transition * to_world.transpose();
  result.transition.setIdentity();
  result.transition.topLeftCorner<15, 15>() = F;
  result.transition.block<3, 2>(kVelocity, kTilt) = dt * dg_dtilt;
  result.transition.block<3, 2>(kPosition, kTilt) = 0.5 * dt * dt * dg_dtilt;
  result.transition.col(kTimeOffset).head<15>() =
      Rate(result.trajectory.back(), samples.back(), gravity_world) -
      F * Rate(start.mean.nav, samples.front(), gravity_world);

  const Matrix15d noise =
      to_world * level.covariance * to_world.transpose() - F * P * F.transpose();
  result.end.mean = {.nav = result.trajectory.back(),
                     .tilt = start.mean.tilt,
                     .time_offset = start.mean.time_offset};
  result.end.covariance = result.transition * start.covariance * result.transition.transpose();
  result.end.covariance.topLeftCorner<15, 15>() += noise;
  result.end.covariance.diagonal().segment<2>(kTilt).array() += kTiltWalk * kTiltWalk * dt;
  // What is held stays held.
  if (start.covariance(kTimeOffset, kTimeOffset) > 0.0)
    result.end.covariance(kTimeOffset, kTimeOffset) += kTimeOffsetWalk * kTimeOffsetWalk * dt;
  result.end.covariance =
      (0.5 * (result.end.covariance + result.end.covariance.transpose())).eval();
  return result;
}

}  // namespace mlvi

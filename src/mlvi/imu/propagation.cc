// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/propagation.h"

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/imu/integration_step.h"

namespace mlvi {
namespace {

NavState Advance(const NavState& state, const internal::ImuStep& step, Time stamp, double gravity) {
  const Eigen::Vector3d g(0.0, 0.0, -gravity);
  const Eigen::Quaterniond& R = state.T_world_body.rotation();
  NavState next = state;
  next.stamp = stamp;
  next.T_world_body =
      Pose3(R * step.rotation, state.T_world_body.translation() + step.dt * state.v_world_body +
                                   0.5 * step.dt * step.dt * g + R * step.position);
  next.v_world_body += step.dt * g + R * step.velocity;
  return next;
}

// Cubic Hermite between positions and velocities at both ends; `dt` in s, `alpha` in [0, 1].
Eigen::Vector3d CubicHermite(const NavState& a, const NavState& b, double dt, double alpha) {
  const double s = alpha * alpha * (3.0 - 2.0 * alpha), beta = 1.0 - alpha;
  return (1.0 - s) * a.T_world_body.translation() + s * b.T_world_body.translation() +
         dt * alpha * beta * (beta * a.v_world_body - alpha * b.v_world_body);
}

}  // namespace

Propagation Propagate(const NavState& start, const Matrix15d& covariance,
                      std::span<const ImuSample> samples, const ImuSpec& imu, double gravity) {
  MLVI_CHECK(!samples.empty(), "no IMU samples to propagate through");
  MLVI_CHECK(start.stamp == samples.front().stamp,
             "the start is valid at {}, the first IMU sample at {}", ToString(start.stamp),
             ToString(samples.front().stamp));
  Propagation result{
      .states = {start}, .covariance = covariance, .transition = Matrix15d::Identity()};
  result.states.reserve(samples.size());
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const internal::ImuStep step =
        internal::IntegrateStep(samples[k - 1], samples[k], start.bias, imu);
    const Eigen::Matrix3d R = result.states.back().T_world_body.R();
    const Matrix15d F = internal::StepTransition(R, step);
    result.covariance =
        (F * result.covariance * F.transpose() + internal::StepNoise(R, step, imu.noise)).eval();
    result.transition = (F * result.transition).eval();
    result.states.push_back(Advance(result.states.back(), step, samples[k].stamp, gravity));
  }
  return result;
}

Pose3 InterpolatePose(std::span<const NavState> states, Time stamp) {
  MLVI_CHECK(!states.empty(), "no states to interpolate between");
  const auto after =
      std::lower_bound(states.begin(), states.end(), stamp,
                       [](const NavState& state, Time time) { return state.stamp < time; });
  if (after == states.begin()) return states.front().T_world_body;
  if (after == states.end()) return states.back().T_world_body;
  const NavState& before = *(after - 1);
  const double dt = (after->stamp - before.stamp).seconds();
  const double alpha = (stamp - before.stamp).seconds() / dt;
  return Pose3(
      InterpolateSo3(before.T_world_body.rotation(), after->T_world_body.rotation(), alpha),
      CubicHermite(before, *after, dt, alpha));
}

}  // namespace mlvi

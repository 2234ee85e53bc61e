// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/preintegration.h"

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/imu/integration_step.h"

namespace mlvi {
namespace {

bool Earlier(const ImuSample& sample, Time time) { return sample.stamp < time; }

// The signal at `time`: linear between neighbours, held beyond the ends. `samples` is not empty.
ImuSample SampleAt(std::span<const ImuSample> samples, Time time) {
  const auto after = std::lower_bound(samples.begin(), samples.end(), time, Earlier);
  ImuSample result = after == samples.end() ? samples.back() : *after;
  if (result.stamp == time) return result;
  if (after != samples.begin() && after != samples.end()) {
    const ImuSample& before = *(after - 1);
    const double alpha = (time - before.stamp).seconds() / (after->stamp - before.stamp).seconds();
    result.angular_velocity =
        (1.0 - alpha) * before.angular_velocity + alpha * after->angular_velocity;
    result.linear_acceleration =
        (1.0 - alpha) * before.linear_acceleration + alpha * after->linear_acceleration;
    result.interpolated_over =
        std::max({after->stamp - before.stamp, before.interpolated_over, after->interpolated_over});
  }
  result.stamp = time;
  return result;
}

// The Jacobians by the biases follow the chain rule through p' = p + v dt + R dp, v' = v + R dv, R'
// = R dR.
void AdvanceBiasJacobians(const Eigen::Matrix3d& R, const internal::ImuStep& step,
                          PreintegratedImu& result) {
  const Eigen::Matrix3d R_hat_dp = R * Hat(step.position), R_hat_dv = R * Hat(step.velocity);
  result.dp_dba += step.dt * result.dv_dba - R * step.position_by_force;
  result.dp_dbg += step.dt * result.dv_dbg - R_hat_dp * result.dR_dbg - R * step.position_by_rate;
  result.dv_dba -= R * step.velocity_by_force;
  result.dv_dbg -= R_hat_dv * result.dR_dbg + R * step.velocity_by_rate;
  result.dR_dbg =
      (step.rotation.toRotationMatrix().transpose() * result.dR_dbg - step.rotation_by_rate).eval();
}

}  // namespace

std::vector<ImuSample> SamplesBetween(std::span<const ImuSample> samples, Time from, Time to) {
  if (samples.empty() || to <= from) return {};
  const auto first =
      std::upper_bound(samples.begin(), samples.end(), from,
                       [](Time time, const ImuSample& sample) { return time < sample.stamp; });
  const auto last = std::lower_bound(first, samples.end(), to, Earlier);
  std::vector<ImuSample> result;
  result.reserve(static_cast<std::size_t>(last - first) + 2);
  result.push_back(SampleAt(samples, from));
  result.insert(result.end(), first, last);
  result.push_back(SampleAt(samples, to));
  return result;
}

PreintegratedImu Preintegrate(std::span<const ImuSample> samples, const ImuBias& bias,
                              const ImuSpec& imu) {
  MLVI_CHECK(!samples.empty(), "no IMU samples to integrate");
  PreintegratedImu result{.from = samples.front().stamp, .to = samples.back().stamp, .bias = bias};
  result.samples = static_cast<int>(samples.size());
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const internal::ImuStep step = internal::IntegrateStep(samples[k - 1], samples[k], bias, imu);
    const Eigen::Matrix3d R = result.delta_R.toRotationMatrix();
    const Matrix15d F = internal::StepTransition(R, step);
    result.covariance =
        (F * result.covariance * F.transpose() + internal::StepNoise(R, step, imu.noise)).eval();
    AdvanceBiasJacobians(R, step, result);
    result.delta_p += step.dt * result.delta_v + R * step.position;
    result.delta_v += R * step.velocity;
    result.delta_R = (result.delta_R * step.rotation).normalized();
  }
  return result;
}

PreintegratedImu CorrectedForBias(const PreintegratedImu& preintegrated, const ImuBias& bias) {
  const Eigen::Vector3d d_ba = bias.accelerometer - preintegrated.bias.accelerometer;
  const Eigen::Vector3d d_bg = bias.gyroscope - preintegrated.bias.gyroscope;
  PreintegratedImu result = preintegrated;
  result.bias = bias;
  result.delta_R = (preintegrated.delta_R * ExpSo3(preintegrated.dR_dbg * d_bg)).normalized();
  result.delta_v += preintegrated.dv_dba * d_ba + preintegrated.dv_dbg * d_bg;
  result.delta_p += preintegrated.dp_dba * d_ba + preintegrated.dp_dbg * d_bg;
  return result;
}

NavState Predict(const NavState& from, const PreintegratedImu& preintegrated, double gravity) {
  const PreintegratedImu delta = CorrectedForBias(preintegrated, from.bias);
  const double dt = delta.dt();
  const Eigen::Vector3d g(0.0, 0.0, -gravity);
  const Eigen::Quaterniond& R = from.T_world_body.rotation();
  NavState result = from;
  result.stamp = delta.to;
  result.T_world_body =
      Pose3(R * delta.delta_R, from.T_world_body.translation() + from.v_world_body * dt +
                                   0.5 * dt * dt * g + R * delta.delta_p);
  result.v_world_body += dt * g + R * delta.delta_v;
  return result;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mlvi/geometry/so3.h"
#include "mlvi/imu/initialization.h"
#include "mlvi/imu/levelling.h"

namespace mlvi {
namespace {

constexpr double kMinimumSeconds = 0.5;
constexpr std::size_t kMinimumSamples = 10;
// A rig at rest, also on a running motor or in a steady hand, stays below these beyond the noise of
// its IMU; a walk and a drive on a smooth floor do not.
constexpr double kRestRateSigma = 0.05;      // rad/s
constexpr double kRestForceSigma = 0.15;     // m/s^2
constexpr double kRestForceDrift = 0.1;      // m/s^2, between the means of both halves
constexpr double kBiasSigmas = 4.5;          // 99.99 % of the biases that the prior expects
constexpr double kRestVelocitySigma = 0.02;  // m/s: the sway that passes the limits above

struct Statistics {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  // Mean of the second half less that of the first.
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();

  double sigma() const { return std::sqrt(variance.sum()); }
};

template <typename Field>
Statistics Summarize(std::span<const ImuSample> samples, Field field) {
  Statistics s;
  const std::size_t half = samples.size() / 2;
  const double count = static_cast<double>(samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) {
    s.mean += field(samples[k]) / count;
    s.drift += field(samples[k]) * (k < half ? -1.0 / static_cast<double>(half)
                                             : 1.0 / static_cast<double>(samples.size() - half));
  }
  for (const ImuSample& sample : samples) {
    s.variance += (field(sample) - s.mean).cwiseAbs2() / (count - 1.0);
  }
  return s;
}

// Variance with which a mean over `seconds` shows the bias at the end of them: of the specified
// noise, or of what was seen if that is more (vibration), plus the walk of the bias (whose end
// differs from its mean by w^2 t / 3).
Eigen::Vector3d VarianceOfMean(const Statistics& s, double density, double walk, double seconds,
                               std::size_t count) {
  constexpr double kSmallestVariance = 1e-10;  // keeps a noiseless IMU's covariance regular
  const double specified = std::max(density * density / seconds, kSmallestVariance);
  return (s.variance / static_cast<double>(count)).cwiseMax(specified).array() +
         walk * walk * seconds / 3.0;
}

// A limit widened by three sigma of the IMU's own white noise on three axes.
double Widened(double limit, double density, double bandwidth) {
  return std::hypot(limit, 3.0 * density * std::sqrt(3.0 * bandwidth));
}

// Why the samples cannot be taken for a rest; empty when they can.
std::string MotionSeen(const Statistics& rate, const Statistics& force, double seconds,
                       const ImuSpec& imu, double gravity) {
  const double rate_limit = Widened(kRestRateSigma, imu.noise.gyroscope_density, imu.rate_hz);
  if (rate.sigma() > rate_limit) {
    return fmt::format("the rate of turn varies by {:.3f} rad/s, more than {:.3f} rad/s",
                       rate.sigma(), rate_limit);
  }
  const double force_limit = Widened(kRestForceSigma, imu.noise.accelerometer_density, imu.rate_hz);
  if (force.sigma() > force_limit) {
    return fmt::format("the acceleration varies by {:.3f} m/s^2, more than {:.3f} m/s^2",
                       force.sigma(), force_limit);
  }
  const double turn_limit = kBiasSigmas * imu.initial_gyroscope_bias_sigma;
  if (rate.mean.norm() > turn_limit) {
    return fmt::format(
        "a mean rate of turn of {:.4f} rad/s is more than the gyroscope bias explains ({:.4f} "
        "rad/s)",
        rate.mean.norm(), turn_limit);
  }
  const double drift_limit =
      Widened(kRestForceDrift, imu.noise.accelerometer_density, 4.0 / seconds);
  if (force.drift.norm() > drift_limit) {
    return fmt::format("the mean acceleration drifts by {:.3f} m/s^2, more than {:.3f} m/s^2",
                       force.drift.norm(), drift_limit);
  }
  const double magnitude_limit = kBiasSigmas * imu.initial_accelerometer_bias_sigma;
  if (std::abs(force.mean.norm() - gravity) > magnitude_limit) {
    return fmt::format(
        "a mean acceleration of {:.3f} m/s^2 differs from gravity ({:.3f} m/s^2) by more than the "
        "accelerometer bias explains ({:.3f} m/s^2); is its unit right?",
        force.mean.norm(), gravity, magnitude_limit);
  }
  return {};
}

// Information of the direction of the mean specific force on rotation and accelerometer bias, plus
// priors and gauge. The magnitude of that force is not used: it would shift the bias away from its
// prior by any error of `gravity`.
Matrix15d CovarianceAtRest(const Eigen::Matrix3d& R, const Eigen::Vector3d& force_variance,
                           const Eigen::Vector3d& rate_variance, const ImuSpec& imu,
                           double gravity) {
  using namespace nav_index;
  const Eigen::Vector3d up = R.transpose().col(2);
  Eigen::Matrix<double, 3, 2> tangent;
  tangent.col(0) = up.unitOrthogonal();
  tangent.col(1) = up.cross(tangent.col(0));
  Eigen::Matrix<double, 2, 15> J = Eigen::Matrix<double, 2, 15>::Zero();
  J.middleCols<3>(kRotation) = tangent.transpose() * Hat(gravity * up);
  J.middleCols<3>(kAccelerometerBias) = tangent.transpose();
  const Eigen::Matrix2d direction_covariance =
      tangent.transpose() * force_variance.asDiagonal() * tangent;
  Matrix15d information = J.transpose() * direction_covariance.inverse() * J;

  const Eigen::RowVector3d heading = Heading(up).Derivative(R);
  const auto inverse_square = [](double sigma) { return 1.0 / (sigma * sigma); };
  information.block<3, 3>(kRotation, kRotation) +=
      inverse_square(kGaugeHeadingSigma) * heading.transpose() * heading;
  information.diagonal().segment<3>(kPosition).array() += inverse_square(kGaugePositionSigma);
  information.diagonal().segment<3>(kVelocity).array() += inverse_square(kRestVelocitySigma);
  information.diagonal().segment<3>(kAccelerometerBias).array() +=
      inverse_square(imu.initial_accelerometer_bias_sigma);
  information.diagonal().segment<3>(kGyroscopeBias) += rate_variance.cwiseInverse();
  return information.llt().solve(Matrix15d(Matrix15d::Identity()));
}

}  // namespace

std::optional<Initialization> InitializeAtRest(std::span<const ImuSample> samples,
                                               const ImuSpec& imu, double gravity,
                                               std::string* why) {
  const auto refuse = [why](std::string reason) -> std::optional<Initialization> {
    if (why != nullptr) *why = std::move(reason);
    return std::nullopt;
  };
  if (samples.size() < kMinimumSamples) {
    return refuse(
        fmt::format("{} IMU samples are too few, {} are needed", samples.size(), kMinimumSamples));
  }
  const double seconds = (samples.back().stamp - samples.front().stamp).seconds();
  if (seconds < kMinimumSeconds) {
    return refuse(fmt::format("{:.2f} s of IMU samples are too short, {:.1f} s are needed", seconds,
                              kMinimumSeconds));
  }
  const Statistics rate = Summarize(samples, [](const ImuSample& s) { return s.angular_velocity; });
  const Statistics force =
      Summarize(samples, [](const ImuSample& s) { return s.linear_acceleration; });
  if (auto motion = MotionSeen(rate, force, seconds, imu, gravity); !motion.empty())
    return refuse(std::move(motion));

  NavState state;
  state.stamp = samples.front().stamp;
  state.T_world_body = Pose3(LevelRotation(force.mean), Eigen::Vector3d::Zero());
  state.bias.gyroscope = rate.mean;
  Initialization result;
  result.states = {state, state};
  result.states.back().stamp = samples.back().stamp;
  const ImuNoise& noise = imu.noise;
  result.covariance =
      CovarianceAtRest(state.T_world_body.R(),
                       VarianceOfMean(force, noise.accelerometer_density,
                                      noise.accelerometer_random_walk, seconds, samples.size()),
                       VarianceOfMean(rate, noise.gyroscope_density, noise.gyroscope_random_walk,
                                      seconds, samples.size()),
                       imu, gravity);
  result.method = "static";
  return result;
}

}  // namespace mlvi

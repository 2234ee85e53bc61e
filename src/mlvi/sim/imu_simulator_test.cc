// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/imu_simulator.h"

#include <gtest/gtest.h>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

PoseSpline AtRest(double seconds) {
  const auto knots = static_cast<std::size_t>(seconds) + 4;
  return PoseSpline(Time::FromNanoseconds(0), Duration::FromSeconds(1.0),
                    std::vector<Pose3>(knots, Pose3(ExpSo3({0.3, -0.2, 1.0}), {1.0, 2.0, 3.0})));
}

// Noise-free readings at 4 kHz, integrated by steps that are exact for linear rates (midpoint
// values of the odd samples between even ones), come back to the trajectory. The integrator shares
// nothing with the estimators'.
TEST(ImuSimulator, ReadingsIntegrateToTheTrajectory) {
  for (const char* sequence : {"courtyard-easy", "courtyard-hard"}) {
    SequenceOptions options = StandardSequence(sequence, test::NewerCollege(), 12.0);
    const Recording recording(options);
    const ImuPhysics physics{
        .rate_hz = 4000.0, .initial_accelerometer_bias = 0.0, .initial_gyroscope_bias = 0.0};
    const ImuSimulator imu(physics, recording.motion(), recording.begin(), recording.end(),
                           RandomStream(1));
    NavState state = recording.GroundTruth(recording.begin());
    Eigen::Vector3d p = state.T_world_body.translation(), v = state.v_world_body;
    Eigen::Quaterniond q = state.T_world_body.rotation();
    const double h = 2.0 / physics.rate_hz;
    const Eigen::Vector3d g(0.0, 0.0, -physics.gravity);
    for (std::size_t i = 0; i + 2 < imu.size(); i += 2) {
      const ImuSample a = imu.Sample(i), m = imu.Sample(i + 1), b = imu.Sample(i + 2);
      const Eigen::Quaterniond q_mid =
          q * ExpSo3(h / 8.0 * (a.angular_velocity + 3.0 * m.angular_velocity));
      const Eigen::Quaterniond q_end =
          q *
          ExpSo3(h / 6.0 * (a.angular_velocity + 4.0 * m.angular_velocity + b.angular_velocity));
      const Eigen::Vector3d a0 = q * a.linear_acceleration + g,
                            a1 = q_mid * m.linear_acceleration + g,
                            a2 = q_end * b.linear_acceleration + g;
      p += h * v + h * h / 6.0 * (a0 + 2.0 * a1);
      v += h / 6.0 * (a0 + 4.0 * a1 + a2);
      q = q_end;
    }
    const NavState truth = recording.GroundTruth(
        recording.begin() + Duration::FromSeconds(h * static_cast<double>((imu.size() - 1) / 2)));
    EXPECT_GT((truth.T_world_body.translation() - state.T_world_body.translation()).norm(), 5.0);
    EXPECT_LT((p - truth.T_world_body.translation()).norm(), 1e-4) << sequence;
    EXPECT_LT((v - truth.v_world_body).norm(), 1e-4) << sequence;
    EXPECT_LT(LogSo3(q.conjugate() * truth.T_world_body.rotation()).norm(), 1e-5) << sequence;
  }
}

// White noise by the variance of the readings, random walks by that of the bias steps; tolerance
// five sigma of the estimate of a standard deviation, 1 / sqrt(2 n).
TEST(ImuSimulator, NoiseHasTheSpecifiedDensities) {
  const ImuNoise noise{1.1e-3, 2.3e-4, 3.4e-5, 8.3e-6};
  const ImuPhysics physics{.rate_hz = 200.0, .noise = noise};
  const PoseSpline motion = AtRest(200.0);
  const ImuSimulator imu(physics, motion, motion.begin(), motion.end(), RandomStream(11));
  const double dt = 1.0 / physics.rate_hz, n = static_cast<double>(imu.size());
  const Eigen::Vector3d force =
      motion.PoseAt(motion.begin()).rotation().conjugate() * Eigen::Vector3d(0.0, 0.0, 9.81);
  double accelerometer = 0.0, gyroscope = 0.0, accelerometer_walk = 0.0, gyroscope_walk = 0.0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const ImuSample s = imu.Sample(i);
    const ImuBias bias = imu.BiasAt(s.stamp);
    accelerometer += (s.linear_acceleration - force - bias.accelerometer).squaredNorm();
    gyroscope += (s.angular_velocity - bias.gyroscope).squaredNorm();
    if (i == 0) continue;
    const ImuBias last = imu.BiasAt(imu.StampOf(i - 1));
    accelerometer_walk += (bias.accelerometer - last.accelerometer).squaredNorm();
    gyroscope_walk += (bias.gyroscope - last.gyroscope).squaredNorm();
  }
  const double tolerance = 5.0 / std::sqrt(2.0 * 3.0 * n);
  const auto density = [&](double sum, double scale) { return std::sqrt(sum / (3.0 * n)) * scale; };
  EXPECT_NEAR(density(accelerometer, std::sqrt(dt)) / noise.accelerometer_density, 1.0, tolerance);
  EXPECT_NEAR(density(gyroscope, std::sqrt(dt)) / noise.gyroscope_density, 1.0, tolerance);
  EXPECT_NEAR(density(accelerometer_walk, 1.0 / std::sqrt(dt)) / noise.accelerometer_random_walk,
              1.0, tolerance);
  EXPECT_NEAR(density(gyroscope_walk, 1.0 / std::sqrt(dt)) / noise.gyroscope_random_walk, 1.0,
              tolerance);
}

TEST(ImuSimulator, Saturates) {
  const ImuPhysics physics{.rate_hz = 100.0, .accelerometer_saturation = 5.0};
  const PoseSpline motion = AtRest(2.0);
  const ImuSimulator imu(physics, motion, motion.begin(), motion.end(), RandomStream(1));
  EXPECT_DOUBLE_EQ(imu.Sample(10).linear_acceleration.cwiseAbs().maxCoeff(), 5.0);
}

}  // namespace
}  // namespace mlvi

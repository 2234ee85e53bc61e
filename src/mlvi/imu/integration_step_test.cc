// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/integration_step.h"

#include <gtest/gtest.h>

namespace mlvi::internal {
namespace {

ImuSample Sample(double seconds, const Eigen::Vector3d& rate, const Eigen::Vector3d& force) {
  ImuSample sample;
  sample.stamp = Time::FromNanoseconds(1'700'000'000'000'000'000) + Duration::FromSeconds(seconds);
  sample.angular_velocity = rate;
  sample.linear_acceleration = force;
  return sample;
}

const Eigen::Vector3d kRate(0.3, -0.5, 0.7), kForce(1.0, 9.0, -3.0);

ImuStep Over(double seconds, const Eigen::Vector3d& rate = kRate) {
  return IntegrateStep(Sample(0.0, rate, kForce), Sample(seconds, rate, kForce), {}, {});
}

// Turns from a hundredth of a radian to nine times round, across the switch of the formulas.
class StepLength : public ::testing::TestWithParam<double> {};

TEST_P(StepLength, EqualsManyShortSteps) {
  constexpr int kParts = 1024;
  const ImuStep whole = Over(GetParam()), part = Over(GetParam() / kParts);
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), p = Eigen::Vector3d::Zero();
  for (int i = 0; i < kParts; ++i) {
    p += part.dt * v + R * part.position;
    v += R * part.velocity;
    R = R * part.rotation;
  }
  // Stamps are whole nanoseconds: a part may be off by half of one.
  const double tolerance = 1e-9 + 1e-9 * kParts / GetParam();
  EXPECT_LT(R.angularDistance(whole.rotation), tolerance * (1.0 + GetParam()));
  EXPECT_LT((v - whole.velocity).norm(), tolerance * 10.0 * GetParam());
  EXPECT_LT((p - whole.position).norm(), tolerance * 10.0 * GetParam() * GetParam());
}

TEST_P(StepLength, DerivativesAgreeWithDifferences) {
  const ImuStep step = Over(GetParam());
  constexpr double kStep = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(axis);
    const ImuStep plus = Over(GetParam(), kRate + d), minus = Over(GetParam(), kRate - d);
    const Eigen::Vector3d velocity = (plus.velocity - minus.velocity) / (2.0 * kStep);
    const Eigen::Vector3d position = (plus.position - minus.position) / (2.0 * kStep);
    EXPECT_LT((velocity - step.velocity_by_rate.col(axis)).norm(), 1e-5 * (1.0 + velocity.norm()));
    EXPECT_LT((position - step.position_by_rate.col(axis)).norm(), 1e-5 * (1.0 + position.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(ImuStep, StepLength, ::testing::Values(0.01, 0.5, 3.0, 3.2, 10.0, 60.0));

}  // namespace
}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/imu_residual.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/base/error.h"
#include "mlvi/imu/imu_testing.h"

namespace mlvi {
namespace {

using testing::kGravity;
using testing::NormalVector;
using testing::TestImu;
using testing::Walk;

const ImuBias kBias{.accelerometer = {0.05, -0.08, 0.1}, .gyroscope = {0.01, -0.02, 0.015}};

TEST(ImuResidualTest, VanishesForThePredictedState) {
  const auto delta = Preintegrate(Walk().Samples(0.0, 0.5, 200.0), kBias, TestImu());
  NavState first = Walk().State(0.0);
  first.bias = {.accelerometer = kBias.accelerometer + Eigen::Vector3d(0.02, 0.01, 0.0),
                .gyroscope = kBias.gyroscope + Eigen::Vector3d(0.0, 0.001, -0.002)};
  EXPECT_LT(
      EvaluateImuResidual(first, Predict(first, delta, kGravity), delta, kGravity).value.norm(),
      1e-13);
}

TEST(ImuResidualTest, JacobiansMatchNumericDifferentiation) {
  const auto delta = Preintegrate(Walk().Samples(0.0, 0.5, 200.0), kBias, TestImu());
  RandomStream random(2, "residual");
  for (int trial = 0; trial < 20; ++trial) {
    const auto disturbed = [&](const NavState& state) {
      Vector15d d;
      for (int i = 0; i < 15; ++i) d(i) = (i < 9 ? 0.3 : 0.05) * random.Normal();
      return BoxPlus(state, d);
    };
    const NavState first = disturbed(Walk().State(0.0)), second = disturbed(Walk().State(0.5));
    const ImuResidual residual = EvaluateImuResidual(first, second, delta, kGravity);
    constexpr double kStep = 1e-6;
    for (int i = 0; i < 15; ++i) {
      const Vector15d d = kStep * Vector15d::Unit(i);
      const Vector15d by_first =
          (EvaluateImuResidual(BoxPlus(first, d), second, delta, kGravity).value -
           EvaluateImuResidual(BoxPlus(first, -d), second, delta, kGravity).value) /
          (2.0 * kStep);
      const Vector15d by_second =
          (EvaluateImuResidual(first, BoxPlus(second, d), delta, kGravity).value -
           EvaluateImuResidual(first, BoxPlus(second, -d), delta, kGravity).value) /
          (2.0 * kStep);
      EXPECT_LT((residual.by_first.col(i) - by_first).norm(), 1e-8) << "first, component " << i;
      EXPECT_LT((residual.by_second.col(i) - by_second).norm(), 1e-8) << "second, component " << i;
    }
  }
}

TEST(SqrtInformationTest, InvertsTheCovariance) {
  const auto delta = Preintegrate(Walk().Samples(0.0, 0.5, 200.0), kBias, TestImu());
  const Matrix15d L = SqrtInformation(delta);
  EXPECT_LT((L * delta.covariance * L.transpose() - Matrix15d::Identity()).norm(), 1e-8);
}

TEST(SqrtInformationTest, BiasesWithoutWalkAreInEffectConstant) {
  ImuSpec imu = TestImu();
  imu.noise.accelerometer_random_walk = imu.noise.gyroscope_random_walk = 0.0;
  const auto delta = Preintegrate(Walk().Samples(0.0, 0.5, 200.0), kBias, imu);
  const Matrix15d L = SqrtInformation(delta);
  EXPECT_TRUE(L.allFinite());
  EXPECT_GE(L(nav_index::kAccelerometerBias, nav_index::kAccelerometerBias), 1e5);
  auto poisoned = delta;
  poisoned.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SqrtInformation(poisoned), ContractViolation);
}

}  // namespace
}  // namespace mlvi

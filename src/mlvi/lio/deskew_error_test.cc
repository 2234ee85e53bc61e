// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/deskew_error.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "mlvi/base/random.h"
#include "mlvi/lio/normal_equations.h"

namespace mlvi {
namespace {

constexpr double kSpan = 0.1;

Eigen::Vector3d Gaussian(RandomStream& random) {
  const double x = random.Normal(), y = random.Normal(), z = random.Normal();
  return {x, y, z};
}

TEST(DeskewCovariance, OfPartsThatTellTheSameIsThatOfTheMeanLag) {
  SweepParts equal;
  for (Matrix6d& part : equal) part = 1e6 * Matrix6d::Identity();
  const Eigen::Matrix3d velocity = Eigen::Vector3d(1e-2, 2e-2, 3e-2).asDiagonal();
  const Eigen::Matrix3d bias = Eigen::Vector3d(1e-4, 2e-4, 3e-4).asDiagonal();
  const auto relative = [&](const DeskewError& error, int offset, const Eigen::Matrix3d& expected) {
    const Matrix6d D = DeskewCovariance(error, equal);
    return (D.block<3, 3>(offset, offset) - expected).norm() / expected.norm();
  };
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  // Eight parts for a continuum: off by 1 / (2 8^2) of the second moments, twice that of higher.
  EXPECT_LT(relative({.span = kSpan, .velocity = velocity}, 0, 0.25 * kSpan * kSpan * velocity),
            1e-4);
  EXPECT_LT(relative({.span = kSpan, .gyroscope_bias = bias}, 3, 0.25 * kSpan * kSpan * bias),
            1e-4);
  // (1/T) int_0^T of a walk: s^2 T / 3. Of its integral: s^2 T^3 / 20.
  EXPECT_LT(relative({.span = kSpan, .gyroscope_density = 2.0}, 3, 4.0 * kSpan / 3.0 * I), 0.01);
  EXPECT_LT(relative({.span = kSpan, .accelerometer_density = 2.0}, 0,
                     4.0 * std::pow(kSpan, 3) / 20.0 * I),
            0.03);
}

// A turning beam in a room whose walls are far away, its firings one after the other.
std::vector<Correspondence> Turn(RandomStream& random) {
  std::vector<Correspondence> correspondences;
  constexpr int kFirings = 600;
  for (int k = 0; k < kFirings; ++k) {
    const double share = (k + 0.5) / kFirings, azimuth = 2.0 * std::numbers::pi * share;
    Correspondence c;
    c.lag = static_cast<float>(1.0 - share);
    c.point = {20.0 * std::cos(azimuth), 20.0 * std::sin(azimuth), -1.5 + random.Uniform()};
    c.anchor = c.point;
    c.normal = k % 3 == 0 ? Eigen::Vector3d::UnitZ() : Gaussian(random).normalized();
    c.variance = 1e-4;
    correspondences.push_back(c);
  }
  return correspondences;
}

// Against the definition: bend the sweep by a motion with noise, see where the pose comes to lie.
TEST(DeskewCovariance, IsTheScatterOfPosesFoundByBentSweeps) {
  const DeskewError error{.span = kSpan,
                          .velocity = 4e-4 * Eigen::Matrix3d::Identity(),
                          .gyroscope_bias = 1e-6 * Eigen::Matrix3d::Identity(),
                          .accelerometer_density = 0.3,
                          .gyroscope_density = 3e-3};
  RandomStream random(1);
  const std::vector<Correspondence> straight = Turn(random);
  RegistrationConfig config;
  config.noise_inflation = 1.0;
  config.robust_width = 100.0;
  const Matrix6d expected = DeskewCovariance(error, Linearize(straight, Pose3(), config).parts);
  Matrix6d scatter = Matrix6d::Zero();
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<Correspondence> bent = straight;
    const double dt = kSpan / static_cast<double>(bent.size());
    const Eigen::Vector3d bias = 1e-3 * Gaussian(random);
    Eigen::Vector3d v = 0.02 * Gaussian(random), p = Eigen::Vector3d::Zero(), turn = p;
    for (std::size_t k = bent.size(); k-- > 0;) {  // from the end, where the pose is known, back
      p += v * dt;
      v += error.accelerometer_density * std::sqrt(dt) * Gaussian(random);
      turn += bias * dt + error.gyroscope_density * std::sqrt(dt) * Gaussian(random);
      bent[k].point += p + turn.cross(bent[k].point);
    }
    const PoseNormalEquations sums = Linearize(bent, Pose3(), config);
    const Vector6d x = sums.A.ldlt().solve(sums.b);
    scatter += x * x.transpose() / kTrials;
  }
  // In units of what is expected: the identity, each variance scattering by sqrt(2 / trials) = 7 %.
  const Eigen::LLT<Matrix6d> llt(expected);
  const Matrix6d half = llt.matrixL().solve(scatter);
  const Matrix6d whitened = llt.matrixL().solve(half.transpose());
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(whitened(i, i), 1.0, 0.3) << i;
  EXPECT_NEAR(whitened.trace() / 6.0, 1.0, 0.15);
  // The lever counts: more than the turn alone, by far, is a shift.
  EXPECT_GT(expected(2, 2), 10.0 * 0.05 * 0.05 * 4e-4);
}

TEST(DeskewCovariance, IsBoundedWhereAllPartsAreBlind) {
  SweepParts blind;
  for (Matrix6d& part : blind) part(0, 0) = 1e6;
  const Matrix6d D = DeskewCovariance(
      {.span = kSpan, .velocity = Eigen::Matrix3d::Identity(), .gyroscope_density = 1e-3}, blind);
  EXPECT_TRUE(D.allFinite());
  EXPECT_NEAR(D(0, 0), 0.25 * kSpan * kSpan, 1e-4);
  EXPECT_LT(D(1, 1), 1e-9);
}

}  // namespace
}  // namespace mlvi

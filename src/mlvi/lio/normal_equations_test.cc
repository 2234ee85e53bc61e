// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/normal_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include "mlvi/base/random.h"
#include "mlvi/factors/point_factors.h"
#include "mlvi/geometry/robust_kernels.h"

namespace mlvi {
namespace {

Matrix6d RandomInformation(RandomStream& random, int rank) {
  Matrix6d A = Matrix6d::Zero();
  for (int k = 0; k < rank; ++k) {
    Vector6d h;
    for (int i = 0; i < 6; ++i) h[i] = random.Normal();
    A += h * h.transpose();
  }
  return A;
}

TEST(NormalEquations, ACommonErrorAddsToTheCovarianceAndLeavesTheSolution) {
  RandomStream random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Matrix6d A = RandomInformation(random, 12), D = RandomInformation(random, 6);
    Vector6d b;
    for (int i = 0; i < 6; ++i) b[i] = random.Normal();
    Matrix6d with = A;
    Vector6d b_with = b;
    AddCommonError(D, with, b_with);
    EXPECT_LT((with.inverse() - (A.inverse() + D)).norm(), 1e-6 * (A.inverse() + D).norm());
    EXPECT_LT((with.inverse() * b_with - A.inverse() * b).norm(), 1e-6 * (A.inverse() * b).norm());
  }
}

TEST(NormalEquations, ACommonErrorTellsNothingAboutBlindDirections) {
  RandomStream random(2);
  Matrix6d A = RandomInformation(random, 4);
  const Eigen::FullPivLU<Matrix6d> before(A);
  const Eigen::MatrixXd blind = before.kernel();
  ASSERT_EQ(blind.cols(), 2);
  Vector6d b = A * Vector6d::Ones();
  AddCommonError(RandomInformation(random, 6), A, b);
  EXPECT_LT((A * blind).norm(), 1e-9 * A.norm() * blind.norm());
}

// Constraints in all directions at random points, as wrong as `sigma` says, which claim `claimed`.
std::vector<Correspondence> Noisy(double sigma, double claimed, int count, RandomStream& random) {
  const auto vector = [&] {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    return Eigen::Vector3d(x, y, z);
  };
  std::vector<Correspondence> correspondences(static_cast<std::size_t>(count));
  for (Correspondence& c : correspondences) {
    c.point = 3.0 * vector();
    c.normal = vector().normalized();
    c.anchor = c.point + sigma * random.Normal() * c.normal;
    c.variance = claimed * claimed;
  }
  return correspondences;
}

TEST(NoiseScale, IsTheRatioOfNoiseToClaim) {
  RandomStream random(3);
  for (const double ratio : {0.5, 1.0, 2.0, 3.0}) {
    std::vector<Correspondence> correspondences = Noisy(0.02 * ratio, 0.02, 4000, random);
    // A median of n values of |x| scatters by 1.17 / sqrt(n) = 1.9 % of a sigma: four sigmas.
    EXPECT_NEAR(NoiseScale(correspondences, Pose3()) / ratio, 1.0, 0.075);
    // A tenth of outliers makes it the 55.6th percentile of the others, 1.135 times the median.
    for (std::size_t i = 0; i < 400; ++i) correspondences[i].anchor += correspondences[i].normal;
    EXPECT_NEAR(NoiseScale(correspondences, Pose3()) / ratio, 1.135, 0.085);
  }
  EXPECT_EQ(NoiseScale({}, Pose3()), 1.0);
}

// As Register does: the claims follow the residuals, kernel as configured.
TEST(NormalEquations, TheInformationIsThatOfTheNoiseWhateverIsClaimed) {
  RegistrationConfig config;
  config.noise_inflation = 1.0;
  for (const double ratio : {0.5, 1.0, 2.0, 3.0}) {
    RandomStream random(4);
    double nees = 0.0;
    constexpr int kTrials = 200;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<Correspondence> correspondences = Noisy(0.02 * ratio, 0.02, 300, random);
      const double scale = NoiseScale(correspondences, Pose3());
      for (Correspondence& c : correspondences) c.variance *= scale * scale;
      PoseNormalEquations sums;
      Pose3 found;
      for (int step = 0; step < 6; ++step) {
        sums = Linearize(correspondences, found, config);
        const Vector6d x = -sums.A.ldlt().solve(sums.b);
        found = Pose3(found.rotation() * ExpSo3(x.tail<3>()), found.translation() + x.head<3>());
      }
      Vector6d error;
      error << found.translation(), LogSo3(found.rotation());
      nees += error.dot(sums.A * error) / kTrials;
    }
    // Six degrees of freedom, mean of 200 trials: four sigmas are 1. Cauchy weights at 2 sigma make
    // the variance 1.083 times that of least squares, the sum of the weights claims 1.187 times.
    EXPECT_NEAR(nees, 6.0 * 1.083 / 1.187, 1.0) << "noise " << ratio << " times what is claimed";
  }
}

// Against the residual of factors/point_factors.h, differentiated numerically.
TEST(NormalEquations, AreThoseOfPointToPlaneFactors) {
  RandomStream random(5);
  const RegistrationConfig config;
  std::vector<Correspondence> correspondences = Noisy(0.03, 0.02, 50, random);
  const Pose3 at(ExpSo3({0.02, -0.01, 0.03}), {0.03, 0.01, -0.02});
  const auto displaced = [&](const Vector6d& d) {  // world position, body rotation
    return Pose3(at.rotation() * ExpSo3(d.tail<3>()), at.translation() + d.head<3>());
  };
  Matrix6d A = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (Correspondence& c : correspondences) {
    c.gate = 1e-4;
    const PointToPlaneFactor factor(c.point, c.normal, -c.normal.dot(c.anchor),
                                    config.noise_inflation * std::sqrt(c.variance));
    const auto residual = [&](const Pose3& pose) {
      std::array<double, kPoseBlockSize> block{};
      StorePose(pose, block.data());
      const double* blocks[] = {block.data()};
      double value = 0.0;
      EXPECT_TRUE(factor.Evaluate(blocks, &value, nullptr));
      return value;
    };
    Vector6d J;
    constexpr double kStep = 1e-5;
    for (int i = 0; i < 6; ++i) {
      const Vector6d d = kStep * Vector6d::Unit(i);
      J[i] = (residual(displaced(d)) - residual(displaced(-d))) / (2.0 * kStep);
    }
    const double r = residual(at);
    const double z = r * config.noise_inflation * std::sqrt(c.variance);
    const double weight = CauchyKernel{config.robust_width}.Weight(z * z / (c.variance + c.gate));
    A += weight * J * J.transpose();
    b += weight * r * J;
  }
  const PoseNormalEquations sums = Linearize(correspondences, at, config);
  EXPECT_LT((sums.A - A).norm(), 1e-6 * A.norm());
  EXPECT_LT((sums.b - b).norm(), 1e-6 * b.norm());
}

// E[n n^T] of a noisy normal less that of its mean, in the information of one constraint.
TEST(NormalEquations, NoisyNormalsFeignWhatDisturbedOnesAdd) {
  RandomStream random(6);
  const Pose3 at(ExpSo3({0.4, -0.1, 0.9}), {1.0, 2.0, -0.5});
  for (Correspondence c : Noisy(0.0, 0.02, 20, random)) {
    c.anchor = at * c.point;  // no residual, whatever the normal
    c.tilt_a = 0.05 * c.normal.unitOrthogonal();
    c.tilt_b = 0.02 * c.normal.cross(c.normal.unitOrthogonal());
    const auto information = [&](const Eigen::Vector3d& normal) {
      Correspondence disturbed = c;
      disturbed.normal = normal;
      return Linearize({disturbed}, at, {}).A;
    };
    Matrix6d added = Matrix6d::Zero();
    for (const Eigen::Vector3d& tilt : {c.tilt_a, c.tilt_b}) {
      added += 0.5 * (information(c.normal + tilt) + information(c.normal - tilt)) -
               information(c.normal);
    }
    const Matrix6d feigned = Linearize({c}, at, {}).feigned;
    EXPECT_LT((feigned - added).norm(), 1e-9 * information(c.normal).norm());
    EXPECT_GT(feigned.norm(), 1e-4 * information(c.normal).norm());
  }
}

}  // namespace
}  // namespace mlvi

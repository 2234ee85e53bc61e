// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/normal_equations.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "mlvi/base/random.h"

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

TEST(NormalEquations, TheVarianceFactorIsOneForResidualsAsClaimed) {
  RandomStream random(3);
  RegistrationConfig config;
  config.robust_width = 100.0;  // hardly robust: the mean is that of the squares
  for (const double true_sigma : {0.01, 0.02, 0.04}) {
    std::vector<Correspondence> correspondences(4000);
    for (Correspondence& c : correspondences) {
      c.point = Eigen::Vector3d(0.0, 0.0, true_sigma * random.Normal());
      c.anchor = Eigen::Vector3d::Zero();
      c.normal = Eigen::Vector3d::UnitZ();
      c.variance = 0.02 * 0.02;
    }
    const double expected = true_sigma * true_sigma / (0.02 * 0.02);
    // A mean of n squares of unit variance scatters by sqrt(2 / n) = 2.2 %: four sigmas.
    EXPECT_NEAR(Linearize(correspondences, Pose3(), config).variance_factor() / expected, 1.0,
                0.09);
  }
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/between_factor.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/factors/factor_testing.h"

namespace mlvi {
namespace {

Vector6d RandomVector6(RandomStream& random, double scale) {
  Vector6d v;
  for (double& x : v) x = scale * random.Normal();
  return v;
}

Matrix6d RandomInformation(RandomStream& random) {
  Matrix6d A;
  for (double& x : A.reshaped()) x = random.Normal();
  return A * A.transpose() + Matrix6d::Identity();
}

FactorBlock Block(const Pose3& pose, const PoseManifold& manifold) {
  FactorBlock block{Eigen::VectorXd(kPoseBlockSize), &manifold};
  StorePose(pose, block.value.data());
  return block;
}

TEST(BetweenFactor, JacobiansAreCorrectAlsoFarFromTheMeasurement) {
  RandomStream random(1, "between");
  const PoseManifold manifold;
  for (const double noise : {0.0, 1e-7, 1e-3, 0.1, 1.0}) {
    for (int i = 0; i < 20; ++i) {
      const Pose3 a = ExpSe3(RandomVector6(random, 1.0)), b = ExpSe3(RandomVector6(random, 1.0));
      const Pose3 measured = a.inverse() * b * ExpSe3(RandomVector6(random, noise));
      const BetweenFactor factor(measured, SqrtInformation(RandomInformation(random)));
      EXPECT_TRUE(JacobiansAreCorrect(factor, {Block(a, manifold), Block(b, manifold)}))
          << "noise " << noise;
    }
  }
}

TEST(BetweenFactor, ResidualVanishesAtTheMeasurementAndIgnoresTheWorldFrame) {
  RandomStream random(2, "between");
  const PoseManifold manifold;
  for (int i = 0; i < 50; ++i) {
    const Pose3 a = ExpSe3(RandomVector6(random, 2.0)), b = ExpSe3(RandomVector6(random, 2.0));
    const Pose3 world = ExpSe3(RandomVector6(random, 2.0));
    const Matrix6d W = SqrtInformation(RandomInformation(random));
    Eigen::VectorXd residual, moved;
    const BetweenFactor exact(a.inverse() * b, W);
    ASSERT_TRUE(internal::EvaluateFactor(exact, {Block(a, manifold), Block(b, manifold)}, &residual,
                                         nullptr));
    EXPECT_LT(residual.norm(), 1e-12);
    const BetweenFactor other(a.inverse() * b * ExpSe3(RandomVector6(random, 0.3)), W);
    internal::EvaluateFactor(other, {Block(a, manifold), Block(b, manifold)}, &residual, nullptr);
    internal::EvaluateFactor(other, {Block(world * a, manifold), Block(world * b, manifold)},
                             &moved, nullptr);
    EXPECT_GT(residual.norm(), 1e-3);
    EXPECT_LT((residual - moved).norm(), 1e-10 * (1.0 + residual.norm()));
  }
}

TEST(SqrtInformation, SquaresToTheInformationAndRefusesIndefinite) {
  RandomStream random(3, "between");
  const Matrix6d information = RandomInformation(random);
  const Matrix6d W = SqrtInformation(information);
  EXPECT_LT((W.transpose() * W - information).norm(), 1e-12 * information.norm());
  Matrix6d indefinite = Matrix6d::Identity();
  indefinite(3, 3) = -1.0;
  EXPECT_THROW(SqrtInformation(indefinite), ContractViolation);
}

// The helper itself must be able to fail.
class WrongFactor final : public ceres::SizedCostFunction<1, 2> {
 public:
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    residuals[0] = parameters[0][0] * parameters[0][1];
    if (jacobians != nullptr && jacobians[0] != nullptr)
      jacobians[0][0] = jacobians[0][1] = parameters[0][1];
    return true;
  }
};

TEST(JacobiansAreCorrect, FindsAWrongJacobian) {
  EXPECT_FALSE(JacobiansAreCorrect(WrongFactor(), {{Eigen::Vector2d(1.0, 2.0), nullptr}}));
  EXPECT_TRUE(JacobiansAreCorrect(WrongFactor(), {{Eigen::Vector2d(2.0, 2.0), nullptr}}));
}

}  // namespace
}  // namespace mlvi

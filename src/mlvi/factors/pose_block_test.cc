// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/factors/pose_block.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Jacobian7x6 = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
using Jacobian6x7 = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

class PoseManifoldLaws : public testing::Test {
 protected:
  Vector6d Draw(double scale) {
    Vector6d v;
    for (double& x : v) x = scale * random_.Normal();
    return v;
  }
  Vector7d DrawBlock() {
    Vector7d x;
    StorePose(ExpSe3(Draw(2.0)), x.data());
    if (random_.Uniform() < 0.5) x.tail<4>() *= -1.0;  // both covers of a rotation
    return x;
  }
  Vector7d Plus(const Vector7d& x, const Vector6d& delta) const {
    Vector7d y;
    manifold_.Plus(x.data(), delta.data(), y.data());
    return y;
  }
  Vector6d Minus(const Vector7d& y, const Vector7d& x) const {
    return BoxMinus(LoadPose(y.data()), LoadPose(x.data()));
  }
  RandomStream random_{1, "pose_block"};
  PoseManifold manifold_;
};

TEST_F(PoseManifoldLaws, PlusAndMinusAreInverse) {
  for (const double scale : {0.0, 1e-9, 1e-5, 1e-2, 0.5}) {
    for (int i = 0; i < 50; ++i) {
      const Vector7d x = DrawBlock();
      Vector6d delta = Draw(scale);
      if (delta.tail<3>().norm() > 3.1) continue;  // beyond the injectivity radius
      EXPECT_LT((Minus(Plus(x, delta), x) - delta).norm(), 1e-13 * (1.0 + x.norm()));
      EXPECT_LT((Minus(Plus(x, Minus(DrawBlock(), x)), x)).tail<3>().norm(), 3.1416);
    }
  }
  const Vector7d x = DrawBlock(), y = DrawBlock();
  EXPECT_LT(BoxMinus(LoadPose(Plus(x, Minus(y, x)).data()), LoadPose(y.data())).norm(), 1e-12);
}

TEST_F(PoseManifoldLaws, JacobiansMatchDifferencesAndInvertEachOther) {
  for (int i = 0; i < 50; ++i) {
    const Vector7d x = DrawBlock();
    Jacobian7x6 plus;
    manifold_.PlusJacobian(x.data(), plus.data());
    const Jacobian6x7 minus = PoseMinusJacobian(x.data());
    EXPECT_LT((minus * plus - Matrix6d::Identity()).norm(), 1e-12);
    for (int k = 0; k < 6; ++k) {
      const double step = 1e-6;
      const Vector6d delta = step * Vector6d::Unit(k);
      const Vector7d numeric = (Plus(x, delta) - Plus(x, -delta)) / (2.0 * step);
      EXPECT_LT((plus.col(k) - numeric).norm(), 1e-8);
    }
    // Along the manifold (the derivative across the unit sphere is a convention).
    const Vector6d direction = Draw(1.0);
    const Vector6d along = Minus(Plus(x, 1e-6 * direction), x) / 1e-6;
    EXPECT_LT((minus * (plus * direction) - along).norm(), 1e-8 * (1.0 + direction.norm()));
  }
}

TEST(PoseBlock, RoundTripKeepsThePose) {
  const Pose3 pose(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.0, 2.0, 3.0});
  double block[kPoseBlockSize];
  StorePose(pose, block);
  EXPECT_EQ(block[0], 1.0);
  EXPECT_EQ(block[6], 0.5);  // w last
  EXPECT_LT(BoxMinus(LoadPose(block), pose).norm(), 1e-15);
}

}  // namespace
}  // namespace mlvi

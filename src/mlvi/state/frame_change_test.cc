// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/state/frame_change.h"

#include <gtest/gtest.h>

namespace mlvi {
namespace {

class FrameChangeTest : public ::testing::Test {
 protected:
  FrameChangeTest() {
    estimate_.state.T_world_body = Pose3(ExpSo3({0.4, -0.3, 1.2}), {3.0, -2.0, 1.0});
    estimate_.state.v_world_body = {1.0, 0.5, -0.2};
    estimate_.state.bias.gyroscope = {0.01, 0.02, 0.03};
    const Matrix15d random = Matrix15d::Random();
    estimate_.covariance = random * random.transpose();
  }

  OdometryEstimate estimate_;
  Pose3 T_new_old_{ExpSo3({0.02, -0.01, 2.0}), {10.0, 5.0, -1.0}};
};

TEST_F(FrameChangeTest, ErrorsTurnAsTheCovarianceSays) {
  const OdometryEstimate moved = InFrame(T_new_old_, estimate_);
  Matrix15d J;  // of the moved error by the old one, column by column: it is linear
  for (int i = 0; i < 15; ++i) {
    const NavState disturbed = BoxPlus(estimate_.state, 1e-2 * Vector15d::Unit(i));
    J.col(i) = BoxMinus(InFrame(T_new_old_, disturbed), moved.state) / 1e-2;
  }
  const Matrix15d expected = J * estimate_.covariance * J.transpose();
  EXPECT_LT((moved.covariance - expected).norm(), 1e-9 * expected.norm());
}

TEST_F(FrameChangeTest, RelativeMotionsAndBiasesStay) {
  NavState later = estimate_.state;
  later.T_world_body = later.T_world_body * Pose3(ExpSo3({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0});
  const NavState a = InFrame(T_new_old_, estimate_.state), b = InFrame(T_new_old_, later);
  const Pose3 before = estimate_.state.T_world_body.inverse() * later.T_world_body;
  EXPECT_LT(BoxMinus(a.T_world_body.inverse() * b.T_world_body, before).norm(), 1e-12);
  EXPECT_EQ(a.bias.gyroscope, estimate_.state.bias.gyroscope);
  const Eigen::Vector3d v_body = a.T_world_body.R().transpose() * a.v_world_body;
  EXPECT_LT(
      (v_body - estimate_.state.T_world_body.R().transpose() * estimate_.state.v_world_body).norm(),
      1e-12);
}

TEST_F(FrameChangeTest, DegenerateAxesTurnWithTheWorld) {
  const OdometryEstimate moved = InFrame(T_new_old_, estimate_);
  EXPECT_LT((moved.degeneracy.translation_axes - T_new_old_.R()).norm(), 1e-12);
  EXPECT_LT((moved.degeneracy.rotation_axes - T_new_old_.R()).norm(), 1e-12);
}

}  // namespace
}  // namespace mlvi

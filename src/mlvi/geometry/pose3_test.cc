// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/pose3.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "mlvi/geometry/geometry_generators.h"
#include "mlvi/geometry/numeric_jacobian.h"

namespace mlvi {
namespace {

using testing::AnyPose;
using testing::Twist;
using testing::Vector;
constexpr double kPi = std::numbers::pi;
constexpr double kBound = 20.0;  // m

double Difference(const Pose3& a, const Pose3& b) { return (a.matrix() - b.matrix()).norm(); }

RC_GTEST_PROP(Pose3, GroupLaws, ()) {
  const Pose3 a = *AnyPose(kBound), b = *AnyPose(kBound), c = *AnyPose(kBound);
  RC_ASSERT(Difference((a * b) * c, a * (b * c)) < 1e-12);
  RC_ASSERT(Difference(a * a.inverse(), Pose3()) < 1e-12);
  RC_ASSERT(Difference(a.inverse() * a, Pose3()) < 1e-12);
  RC_ASSERT(Difference(a * Pose3(), a) < 1e-13);
  RC_ASSERT((((a * b).matrix()) - a.matrix() * b.matrix()).norm() < 1e-12);
}

RC_GTEST_PROP(Pose3, ActsOnPointsAsItsMatrix, ()) {
  const Pose3 a = *AnyPose(kBound), b = *AnyPose(kBound);
  const Eigen::Vector3d p = *Vector(kBound);
  RC_ASSERT(((a * b) * p - a * (b * p)).norm() < 1e-12);
  RC_ASSERT((a * p - (a.matrix() * p.homogeneous()).head<3>()).norm() < 1e-12);
  RC_ASSERT(Difference(Pose3::FromMatrix(a.matrix()), a) < 1e-13);
}

RC_GTEST_PROP(Pose3, ExpIsTheMatrixExponential, ()) {
  const Vector6d xi = *Twist(kBound, 3.0 * kPi);
  Eigen::Matrix4d X = Eigen::Matrix4d::Zero();
  X.topLeftCorner<3, 3>() = Hat(xi.tail<3>());
  X.topRightCorner<3, 1>() = xi.head<3>();
  X /= 1024.0;
  Eigen::Matrix4d power = Eigen::Matrix4d::Identity(), sum = power;
  for (int n = 1; n < 12; ++n) sum += power = power * X / n;
  for (int n = 0; n < 10; ++n) sum = sum * sum;
  RC_ASSERT((ExpSe3(xi).matrix() - sum).norm() < 1e-10);
}

RC_GTEST_PROP(Pose3, LogOfExpWithinPi, ()) {
  const Vector6d xi = *Twist(kBound, kPi - 1e-7);
  RC_ASSERT((LogSe3(ExpSe3(xi)) - xi).norm() < 1e-11);
}

RC_GTEST_PROP(Pose3, ExpOfLogIsThePose, ()) {
  const Pose3 pose = *AnyPose(kBound);
  RC_ASSERT(Difference(ExpSe3(LogSe3(pose)), pose) < 1e-12);
}

RC_GTEST_PROP(Pose3, AdjointMovesTheExponential, ()) {
  const Pose3 T = *AnyPose(kBound);
  const Vector6d xi = *Twist(1.0, 2.0);
  RC_ASSERT(Difference(T * ExpSe3(xi) * T.inverse(), ExpSe3(AdjointSe3(T) * xi)) < 1e-11);
  const Pose3 U = *AnyPose(kBound);
  RC_ASSERT((AdjointSe3(T * U) - AdjointSe3(T) * AdjointSe3(U)).norm() < 1e-11);
}

RC_GTEST_PROP(Pose3, RightJacobianIsTheDerivative, ()) {
  const Vector6d xi = *Twist(5.0, 1.9 * kPi);
  const Pose3 inverse = ExpSe3(xi).inverse();
  const Eigen::MatrixXd numeric =
      NumericJacobian([&](const Vector6d& d) { return LogSe3(inverse * ExpSe3(xi + d)); },
                      Vector6d(Vector6d::Zero()));
  RC_ASSERT((RightJacobianSe3(xi) - numeric).norm() < 1e-9);
}

RC_GTEST_PROP(Pose3, RightJacobianInverseInverts, ()) {
  const Vector6d xi = *Twist(5.0, 1.9 * kPi);
  const Matrix6d inverse = RightJacobianInverseSe3(xi);
  const double scale = inverse.norm() * RightJacobianSe3(xi).norm();
  RC_ASSERT((RightJacobianSe3(xi) * inverse - Matrix6d::Identity()).norm() < 1e-13 * scale);
}

// The coupling block changes from its series to the closed form at 0.05 rad: both sides agree with
// differentiation.
TEST(Pose3, RightJacobianAcrossTheSeriesLimit) {
  for (const double angle : {0.0, 1e-8, 1e-3, 0.0499, 0.0501, 0.06}) {
    Vector6d xi;
    xi << 3.0, -2.0, 4.0, angle * Eigen::Vector3d(0.6, -0.48, 0.64);
    const Pose3 inverse = ExpSe3(xi).inverse();
    const Eigen::MatrixXd numeric =
        NumericJacobian([&](const Vector6d& d) { return LogSe3(inverse * ExpSe3(xi + d)); },
                        Vector6d(Vector6d::Zero()));
    EXPECT_LT((RightJacobianSe3(xi) - numeric).norm(), 1e-10) << angle;
  }
}

RC_GTEST_PROP(Pose3, ChartOfAPose, ()) {
  const Pose3 pose = *AnyPose(kBound), other = *AnyPose(kBound);
  const Vector6d delta = *Twist(kBound, kPi - 1e-7);
  // Axioms of a chart (Hertzberg et al. 2013): 0 is neutral, boxminus inverts boxplus and the other
  // way round.
  RC_ASSERT(Difference(BoxPlus(pose, Vector6d::Zero()), pose) < 1e-13);
  RC_ASSERT((BoxMinus(BoxPlus(pose, delta), pose) - delta).norm() < 1e-11);
  RC_ASSERT(Difference(BoxPlus(pose, BoxMinus(other, pose)), other) < 1e-12);
}

// Right perturbation: a change of the world frame leaves differences alone.
RC_GTEST_PROP(Pose3, ChartIsFreeOfTheWorldFrame, ()) {
  const Pose3 a = *AnyPose(kBound), b = *AnyPose(kBound), frame = *AnyPose(kBound);
  const Vector6d difference = BoxMinus(a, b);
  RC_PRE(difference.tail<3>().norm() < kPi - 1e-6);  // at pi the sign of the axis is open
  RC_ASSERT((BoxMinus(frame * a, frame * b) - difference).norm() < 1e-11);
}

RC_GTEST_PROP(Pose3, InterpolationMeetsItsEnds, ()) {
  const Pose3 a = *AnyPose(kBound), b = *AnyPose(kBound);
  RC_ASSERT(Difference(Interpolate(a, b, 0.0), a) < 1e-12);
  RC_ASSERT(Difference(Interpolate(a, b, 1.0), b) < 1e-12);
  const Pose3 middle = Interpolate(a, b, 0.5);
  RC_ASSERT((middle.translation() - 0.5 * (a.translation() + b.translation())).norm() < 1e-12);
}

// Normalised by every operation: a long chain stays a rotation.
TEST(Pose3, LongChainsStayRotations) {
  const Pose3 step(ExpSo3({0.01, -0.02, 0.03}), {0.1, 0.0, 0.0});
  Pose3 pose;
  for (int i = 0; i < 1'000'000; ++i) pose = pose * step;
  EXPECT_NEAR(pose.rotation().norm(), 1.0, 1e-15);
}

}  // namespace
}  // namespace mlvi

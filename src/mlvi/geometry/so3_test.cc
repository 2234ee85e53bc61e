// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/so3.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "mlvi/geometry/geometry_generators.h"
#include "mlvi/geometry/numeric_jacobian.h"

namespace mlvi {
namespace {

using testing::AnyRotation;
using testing::RotationVector;
constexpr double kPi = std::numbers::pi;

RC_GTEST_PROP(So3, HatIsTheCrossProduct, ()) {
  const Eigen::Vector3d a = *testing::Vector(10.0), b = *testing::Vector(10.0);
  RC_ASSERT((Hat(a) * b - a.cross(b)).norm() <= 1e-14 * (1.0 + a.norm() * b.norm()));
}

RC_GTEST_PROP(So3, ExpIsTheMatrixExponential, ()) {
  const Eigen::Vector3d w = *RotationVector(3.0 * kPi);
  // Its Taylor series after halving ten times, squared back.
  const Eigen::Matrix3d X = Hat(w) / 1024.0;
  Eigen::Matrix3d power = Eigen::Matrix3d::Identity(), sum = power;
  for (int n = 1; n < 12; ++n) sum += power = power * X / n;
  for (int n = 0; n < 10; ++n) sum = sum * sum;
  RC_ASSERT((ExpSo3(w).toRotationMatrix() - sum).norm() < 1e-11);
}

RC_GTEST_PROP(So3, LogOfExpWithinPi, ()) {
  const Eigen::Vector3d w = *RotationVector(kPi - 1e-9);
  RC_ASSERT((LogSo3(ExpSo3(w)) - w).norm() < 1e-14 * (1.0 + 10.0 * w.norm()));
}

RC_GTEST_PROP(So3, ExpOfLogIsTheRotation, ()) {
  const Eigen::Quaterniond q = *AnyRotation();
  const Eigen::Vector3d w = LogSo3(q);
  RC_ASSERT(w.norm() <= kPi + 1e-14);
  RC_ASSERT((ExpSo3(w).toRotationMatrix() - q.toRotationMatrix()).norm() < 1e-14 * 10.0);
}

TEST(So3, LogAtPi) {
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0.6, 0, 0.8)}) {
    const Eigen::Vector3d w = LogSo3(Eigen::Quaterniond(0.0, axis.x(), axis.y(), axis.z()));
    EXPECT_NEAR(w.norm(), kPi, 1e-15);
    EXPECT_NEAR(std::abs(w.normalized().dot(axis)), 1.0, 1e-15);
  }
}

RC_GTEST_PROP(So3, RightJacobianIsTheDerivative, ()) {
  const Eigen::Vector3d w = *RotationVector(1.9 * kPi);
  const Eigen::Quaterniond inverse = ExpSo3(w).conjugate();
  const Eigen::MatrixXd numeric = NumericJacobian(
      [&](const Eigen::Vector3d& d) { return Eigen::Vector3d(LogSo3(inverse * ExpSo3(w + d))); },
      Eigen::Vector3d(Eigen::Vector3d::Zero()));
  RC_ASSERT((RightJacobianSo3(w) - numeric).norm() < 1e-10);
}

RC_GTEST_PROP(So3, RightJacobianInverseInverts, ()) {
  const Eigen::Vector3d w = *RotationVector(1.9 * kPi);
  const Eigen::Matrix3d product = RightJacobianSo3(w) * RightJacobianInverseSo3(w);
  // The inverse grows towards 2 pi.
  RC_ASSERT((product - Eigen::Matrix3d::Identity()).norm() <
            1e-13 * RightJacobianInverseSo3(w).norm() * 10.0);
}

// Both sides of the angle at which the closed forms take over from the series.
TEST(So3, JacobiansAreSmoothAcrossTheSeriesLimit) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
  for (double angle : {0.0, 1e-12, 1e-6, 0.9e-4, 0.999999e-4, 1.000001e-4, 1.1e-4, 1e-3}) {
    const Eigen::Vector3d w = angle * axis;
    const Eigen::Matrix3d hat = Hat(w);
    const Eigen::Matrix3d series =
        Eigen::Matrix3d::Identity() - hat / 2.0 + hat * hat / 6.0 - hat * hat * hat / 24.0;
    const Eigen::Matrix3d inverse_series =
        Eigen::Matrix3d::Identity() + hat / 2.0 + hat * hat / 12.0;
    EXPECT_LT((RightJacobianSo3(w) - series).norm(), 1e-13) << angle;
    EXPECT_LT((RightJacobianInverseSo3(w) - inverse_series).norm(), 1e-13) << angle;
  }
}

RC_GTEST_PROP(So3, InterpolationIsAGeodesic, ()) {
  const Eigen::Quaterniond a = *AnyRotation();
  const Eigen::Vector3d w = *RotationVector(kPi - 1e-3);
  const Eigen::Quaterniond b = a * ExpSo3(w);
  const double alpha = *testing::Real(0.0, 1.0);
  const Eigen::Quaterniond middle = InterpolateSo3(a, b, alpha);
  RC_ASSERT((LogSo3(a.conjugate() * middle) - alpha * w).norm() < 1e-12);
  RC_ASSERT(InterpolateSo3(a, b, 0.0).angularDistance(a) < 1e-7);  // acos of nearly 1
  RC_ASSERT(InterpolateSo3(a, b, 1.0).angularDistance(b) < 1e-7);
}

}  // namespace
}  // namespace mlvi

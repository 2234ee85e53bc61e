// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "mlvi/base/random.h"
#include "mlvi/geometry/line_fit.h"
#include "mlvi/geometry/plane_fit.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/geometry/symmetric_eigen.h"

namespace mlvi {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d NormalVector(RandomStream& random) {
  return {random.Normal(), random.Normal(), random.Normal()};
}

// Points with the given standard deviations along the columns of R, around the centre.
Points Patch(int n, const Eigen::Matrix3d& R, const Eigen::Vector3d& sigma,
             const Eigen::Vector3d& centre, RandomStream& random) {
  Points points;
  for (int i = 0; i < n; ++i)
    points.emplace_back(centre + R * sigma.cwiseProduct(NormalVector(random)));
  return points;
}

TEST(SymmetricEigen, AgreesWithTheIterativeSolver) {
  RandomStream random(1);
  for (int trial = 0; trial < 20'000; ++trial) {
    // Spreads from equal axes to 1 : 1e4, as neighbourhoods in point clouds have them.
    const Eigen::Vector3d sigma(std::pow(10.0, random.Uniform(-4.0, 0.0)),
                                std::pow(10.0, random.Uniform(-2.0, 0.0)), 1.0);
    const Eigen::Matrix3d R = ExpSo3(NormalVector(random)).toRotationMatrix();
    const Eigen::Matrix3d C = R * sigma.cwiseAbs2().asDiagonal() * R.transpose();
    const SymmetricEigen3 eigen = EigenOfSymmetric(C);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> oracle(C);
    const double scale = oracle.eigenvalues()[2];
    ASSERT_LT((eigen.values - oracle.eigenvalues()).cwiseAbs().maxCoeff(), 1e-13 * scale);
    ASSERT_LE(eigen.values[0], eigen.values[1]);
    ASSERT_LE(eigen.values[1], eigen.values[2]);
    ASSERT_LT((eigen.vectors.transpose() * eigen.vectors - Eigen::Matrix3d::Identity()).norm(),
              1e-10);
    // An eigenvector is as good as its distance to the next eigenvalue: C v = l v up to sqrt(eps)
    // of the gap's square.
    ASSERT_LT((C * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-7 * scale);
    const double gap = (oracle.eigenvalues()[1] - oracle.eigenvalues()[0]) / scale;
    const double angle = eigen.vectors.col(0).cross(oracle.eigenvectors().col(0)).norm();
    if (gap > 1e-2) {
      ASSERT_LT(angle, 1e-9) << gap;
    }
  }
}

TEST(SymmetricEigen, EqualValuesStayOrthonormal) {
  for (const Eigen::Vector3d& values :
       {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 2),
        Eigen::Vector3d(1, 2, 2), Eigen::Vector3d(0, 0, 1)}) {
    const Eigen::Matrix3d R = ExpSo3({0.3, 1.0, -0.7}).toRotationMatrix();
    const Eigen::Matrix3d C = R * values.asDiagonal() * R.transpose();
    const SymmetricEigen3 eigen = EigenOfSymmetric(C);
    EXPECT_LT((eigen.values - values).norm(), 1e-12);
    EXPECT_LT((eigen.vectors.transpose() * eigen.vectors - Eigen::Matrix3d::Identity()).norm(),
              1e-7);
  }
}

TEST(PointMoments, EqualTheTwoPassFormulasFarFromTheOrigin) {
  RandomStream random(2);
  const Eigen::Vector3d centre(3000.0, -2000.0, 500.0);
  const Points points =
      Patch(50, Eigen::Matrix3d::Identity(), {0.001, 0.002, 0.003}, centre, random);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += (p - centre) / 50.0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& p : points)
    covariance += (p - centre - mean) * (p - centre - mean).transpose() / 50.0;
  PointMoments all, first, second;
  for (std::size_t i = 0; i < points.size(); ++i) {
    all.Add(points[i]);
    (i < 20 ? first : second).Add(points[i]);
  }
  first.Add(second);
  first.Add(PointMoments());
  EXPECT_EQ(first.count(), 50);
  // Coordinates of 3 km carry 5e-13 m of rounding.
  EXPECT_LT((all.centroid() - centre - mean).norm(), 1e-12);
  EXPECT_LT((all.covariance() - covariance).norm(), 1e-14);
  EXPECT_LT((first.covariance() - covariance).norm(), 1e-14);
  EXPECT_LT((first.centroid() - all.centroid()).norm(), 1e-12);
}

TEST(PlaneFit, FindsThePlaneWithinItsNoise) {
  RandomStream random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Matrix3d R = ExpSo3(NormalVector(random)).toRotationMatrix();
    const Eigen::Vector3d centre = 50.0 * NormalVector(random);
    const double noise = 0.01;
    const int n = 200;
    const auto fit = FitPlane(Patch(n, R, {1.0, 0.5, noise}, centre, random));
    ASSERT_TRUE(fit);
    // The tilt has a standard deviation of noise / (sigma sqrt(n)) about each axis; six sigma.
    const double angle = fit->normal.cross(R.col(2)).norm();
    ASSERT_LT(angle, 6.0 * noise / std::sqrt(n) * std::hypot(1.0, 2.0));
    ASSERT_LT(std::abs(R.col(2).dot(fit->centroid - centre)), 6.0 * noise / std::sqrt(n));
    ASSERT_NEAR(std::sqrt(fit->eigenvalues[0]) / noise, 1.0, 6.0 / std::sqrt(2.0 * n));
    // (0.5^2 - 0.01^2) / 1 up to the sampling error of the two variances.
    ASSERT_NEAR(fit->planarity(), 0.25, 6.0 * 0.25 * std::sqrt(4.0 / n));
    const Eigen::Vector3d off = fit->centroid + 2.0 * fit->normal;
    ASSERT_NEAR(fit->SignedDistance(off), 2.0, 1e-12);
  }
}

TEST(PlaneFit, DegenerateSetsHaveNoPlane) {
  Points line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 2.0 * i, -i);
  EXPECT_FALSE(FitPlane(line));
  EXPECT_FALSE(FitPlane(Points(10, Eigen::Vector3d(1, 2, 3))));
  EXPECT_FALSE(FitPlane(Points{{0, 0, 0}, {1, 0, 0}}));
  EXPECT_FALSE(FitPlane(Points{}));
  const auto exact = FitPlane(Points{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  ASSERT_TRUE(exact);
  EXPECT_NEAR(std::abs(exact->normal.z()), 1.0, 1e-15);
}

TEST(LineFit, FindsTheLineWithinItsNoise) {
  RandomStream random(4);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Matrix3d R = ExpSo3(NormalVector(random)).toRotationMatrix();
    const double noise = 0.01;
    const int n = 200;
    const auto fit = FitLine(Patch(n, R, {1.0, noise, noise}, {10, 20, 30}, random));
    ASSERT_TRUE(fit);
    ASSERT_LT(fit->direction.cross(R.col(0)).norm(), 6.0 * noise / std::sqrt(n) * std::sqrt(2.0));
    ASSERT_GT(fit->linearity(), 0.999);
    const Eigen::Vector3d side = fit->direction.unitOrthogonal();
    ASSERT_NEAR(fit->Distance(fit->centroid + 3.0 * fit->direction + 0.5 * side), 0.5, 1e-12);
  }
}

TEST(LineFit, DegenerateSetsHaveNoLine) {
  EXPECT_FALSE(FitLine(Points(4, Eigen::Vector3d(1, 2, 3))));
  EXPECT_FALSE(FitLine(Points{{1, 2, 3}}));
  EXPECT_FALSE(FitLine(Points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}));  // as wide as long
  EXPECT_TRUE(FitLine(Points{{1, 0, 0}, {2, 0, 0}}));
}

TEST(PointMoments, ShapeMeasuresSumToOne) {
  const Eigen::Vector3d values(0.1, 0.5, 2.0);
  EXPECT_NEAR(Linearity(values) + Planarity(values) + Scattering(values), 1.0, 1e-15);
}

}  // namespace
}  // namespace mlvi

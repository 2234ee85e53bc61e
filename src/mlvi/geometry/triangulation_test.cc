// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/triangulation.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/geometry/geometry_generators.h"
#include "mlvi/geometry/tangent_basis.h"

namespace mlvi {
namespace {

Ray RayTo(const Eigen::Vector3d& origin, const Eigen::Vector3d& point, double sigma = 1e-3) {
  return {.origin = origin, .direction = (point - origin).normalized(), .sigma = sigma};
}

// A point 3 to 20 m in any direction from `count` origins within a metre.
std::vector<Ray> RandomRays(RandomStream& random, int count, Eigen::Vector3d& point) {
  const auto vector = [&] {
    return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  point = random.Uniform(3.0, 20.0) * vector().normalized();
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i)
    rays.push_back(RayTo(0.5 * vector(), point, 1e-3 * (1.0 + i % 3)));
  return rays;
}

void Disturb(std::vector<Ray>& rays, RandomStream& random) {
  for (Ray& ray : rays) {
    const Eigen::Vector2d noise(random.Normal(), random.Normal());
    ray.direction =
        (ray.direction + TangentBasis(ray.direction) * (ray.sigma * noise)).normalized();
  }
}

// Fisher information at the truth, from the definition by differences: an oracle independent of the
// solver.
Eigen::Matrix3d CramerRaoBound(const std::vector<Ray>& rays, const Eigen::Vector3d& point) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Ray& ray : rays) {
    Eigen::Matrix3d d_direction;
    for (int k = 0; k < 3; ++k) {
      constexpr double kStep = 1e-5;
      const Eigen::Vector3d h = kStep * Eigen::Vector3d::Unit(k);
      d_direction.col(k) =
          (RayTo(ray.origin, point + h).direction - RayTo(ray.origin, point - h).direction) /
          (2.0 * kStep);
    }
    information += d_direction.transpose() * d_direction / (ray.sigma * ray.sigma);
  }
  return information.inverse();
}

RC_GTEST_PROP(TangentBasis, IsOrthonormalAndRightHandedEverywhere, ()) {
  const Eigen::Vector3d u = *testing::UnitVector();
  for (const Eigen::Vector3d& v :
       {u, Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0)}) {
    const Eigen::Matrix<double, 3, 2> B = TangentBasis(v);
    RC_ASSERT((B.transpose() * B - Eigen::Matrix2d::Identity()).norm() < 1e-12);
    RC_ASSERT((B.col(0).cross(B.col(1)) - v).norm() < 1e-12);
  }
}

TEST(Triangulation, IsExactWithoutNoise) {
  RandomStream random(1);
  for (int trial = 0; trial < 500; ++trial) {
    Eigen::Vector3d point;
    const std::vector<Ray> rays = RandomRays(random, 2 + trial % 6, point);
    const auto midpoint = TriangulateMidpoint(rays[0], rays[1]);
    ASSERT_TRUE(midpoint.has_value());
    EXPECT_LT((*midpoint - point).norm(), 1e-9 * point.norm());
    const auto linear = TriangulateLinear(rays);
    ASSERT_TRUE(linear.has_value());
    EXPECT_LT((linear->head<3>() / (*linear)[3] - point).norm(), 1e-7 * point.norm());
    const auto refined = Triangulate(rays);
    ASSERT_TRUE(refined.has_value());
    EXPECT_LT((refined->point - point).norm(), 1e-9 * point.norm());
    EXPECT_LT(refined->chi_square, 1e-12);
  }
}

TEST(Triangulation, RefinementConvergesToTheSameOptimumFromFarAway) {
  RandomStream random(2);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Vector3d point;
    std::vector<Ray> rays = RandomRays(random, 5, point);
    Disturb(rays, random);
    const auto near = RefineTriangulation(rays, point, {.max_iterations = 50});
    const auto far = RefineTriangulation(rays, 2.0 * point, {.max_iterations = 50});
    ASSERT_TRUE(near && far);
    EXPECT_LT((near->point - far->point).norm(), 1e-6 * point.norm());
  }
}

// An efficient estimator reaches the Cramer-Rao bound: e^T C^-1 e of the errors has mean 3 and
// chi-square the mean 2n-3.
TEST(Triangulation, IsEfficientAgainstTheCramerRaoBound) {
  RandomStream random(3);
  constexpr int kTrials = 4000, kRays = 6;
  double nees = 0.0, chi_square = 0.0, trace_ratio = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::Vector3d point;
    std::vector<Ray> rays = RandomRays(random, kRays, point);
    const Eigen::Matrix3d bound = CramerRaoBound(rays, point);
    for (Ray& ray : rays) ray.sigma *= 0.2;  // within the linear regime at all drawn depths
    Disturb(rays, random);
    const auto result = Triangulate(rays);
    ASSERT_TRUE(result.has_value());
    const Eigen::Vector3d error = result->point - point;
    nees += error.dot((0.04 * bound).ldlt().solve(error));
    chi_square += result->chi_square;
    trace_ratio += result->covariance.trace() / (0.04 * bound.trace());
  }
  // Standard deviations of the means: sqrt(2 * 3 / 4000) = 0.039 and sqrt(2 * 9 / 4000) = 0.067;
  // four of each.
  EXPECT_NEAR(nees / kTrials, 3.0, 0.155);
  EXPECT_NEAR(chi_square / kTrials, 2.0 * kRays - 3.0, 0.27);
  EXPECT_NEAR(trace_ratio / kTrials, 1.0, 0.05);
}

TEST(Triangulation, PointsAtInfinityAreDirectionsAndHaveNoDepth) {
  const Eigen::Vector3d direction = Eigen::Vector3d(1.0, -2.0, -3.0).normalized();
  std::vector<Ray> rays;
  for (const double x : {0.0, 0.3, -0.4}) {
    rays.push_back({.origin = {x, 2.0 * x * x, 0.1}, .direction = direction});
  }
  EXPECT_FALSE(NearestDepths(rays[0], rays[1]).has_value());
  const auto linear = TriangulateLinear(rays);
  ASSERT_TRUE(linear.has_value());
  EXPECT_EQ((*linear)[3], 0.0);
  EXPECT_LT((linear->head<3>() - direction).norm(), 1e-9);
  EXPECT_FALSE(Triangulate(rays).has_value());
}

TEST(Triangulation, RefusesWhatHasNoPointInFront) {
  // Diverging rays meet behind their origins.
  const Ray a{.origin = {-0.5, 0, 0}, .direction = Eigen::Vector3d(-0.1, 0, 1).normalized()};
  const Ray b{.origin = {0.5, 0, 0}, .direction = Eigen::Vector3d(0.1, 0, 1).normalized()};
  EXPECT_FALSE(TriangulateMidpoint(a, b).has_value());
  EXPECT_FALSE(Triangulate(std::vector<Ray>{a, b}).has_value());
  // No baseline, no depth.
  const Ray c{.origin = a.origin, .direction = b.direction};
  EXPECT_FALSE(TriangulateLinear(std::vector<Ray>{a, c}).has_value());
  EXPECT_THROW(TriangulateLinear(std::vector<Ray>{a}), ContractViolation);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/local_fit.h"

#include <gtest/gtest.h>

#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/line_fit.h"
#include "mlvi/geometry/plane_fit.h"
#include "mlvi/geometry/so3.h"

namespace mlvi {
namespace {

constexpr double kThickness = 0.1, kPriorSigma = 0.02;

Neighbors Of(const std::vector<Eigen::Vector3f>& points) {
  Neighbors neighbors;
  for (const Eigen::Vector3f& point : points) neighbors.points[neighbors.count++] = point;
  return neighbors;
}

// Six points with standard deviations `spread` along random axes, 50 m from the origin.
std::vector<Eigen::Vector3f> Scattered(const Eigen::Vector3d& spread, RandomStream& random) {
  const auto gaussian = [&] {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    return Eigen::Vector3d(x, y, z);
  };
  const Eigen::Quaterniond R = ExpSo3(gaussian());
  const Eigen::Vector3d place = 50.0 * gaussian().normalized();
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 6; ++i) {
    points.push_back((place + R * gaussian().cwiseProduct(spread)).cast<float>());
  }
  return points;
}

std::vector<Eigen::Vector3d> Doubles(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3d> result;
  for (const Eigen::Vector3f& point : points) result.push_back(point.cast<double>());
  return result;
}

TEST(LocalFit, IsThePlaneThatMinimisesTheSquaredDistances) {
  RandomStream random(1);
  int fits = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const auto points = Scattered({0.3, 0.2, 0.01}, random);
    const auto fit = FitPlane(Of(points), kThickness, kPriorSigma);
    const auto oracle = FitPlane(Doubles(points));
    if (!fit) continue;
    ++fits;
    ASSERT_TRUE(oracle.has_value());
    EXPECT_LT((fit->centroid - oracle->centroid).norm(), 2e-5);  // float at 50 m: 4e-6
    EXPECT_GT(std::abs(fit->axes.col(0).dot(oracle->normal)), 1.0 - 1e-6);
    EXPECT_LT((fit->variances - oracle->eigenvalues).norm(), 1e-4 * oracle->eigenvalues[2]);
  }
  EXPECT_GT(fits, 80);
}

TEST(LocalFit, IsTheLineThatMinimisesTheSquaredDistances) {
  RandomStream random(2);
  int fits = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const auto points = Scattered({0.3, 0.01, 0.01}, random);
    const auto fit = FitLine(Of(points), kThickness, kPriorSigma);
    const auto oracle = FitLine(Doubles(points));
    if (!fit) continue;
    ++fits;
    ASSERT_TRUE(oracle.has_value());
    EXPECT_GT(std::abs(fit->axes.col(2).dot(oracle->direction)), 1.0 - 1e-6);
  }
  EXPECT_GT(fits, 80);
}

TEST(LocalFit, NothingFitsPointsWithoutExtent) {
  const Eigen::Vector3f p(3.0F, -2.0F, 1.0F);
  const std::vector<Eigen::Vector3f> coincident(6, p);
  EXPECT_FALSE(FitPlane(Of(coincident), kThickness, kPriorSigma).has_value());
  EXPECT_FALSE(FitLine(Of(coincident), kThickness, kPriorSigma).has_value());
  std::vector<Eigen::Vector3f> broken(6, p);
  broken[2].y() = std::nanf("");
  EXPECT_FALSE(FitPlane(Of(broken), kThickness, kPriorSigma).has_value());
  EXPECT_FALSE(FitLine(Of(broken), kThickness, kPriorSigma).has_value());
}

}  // namespace
}  // namespace mlvi

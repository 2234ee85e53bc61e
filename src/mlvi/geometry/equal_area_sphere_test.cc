// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/equal_area_sphere.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"

namespace mlvi {
namespace {

Eigen::Vector3d RandomDirection(RandomStream& random) {
  return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

TEST(EqualAreaSphere, CentersLieInTheirCells) {
  for (const int cells : {2, 3, 12, 100, 1234, 100000}) {
    const EqualAreaSphere sphere(cells);
    EXPECT_NEAR(sphere.size(), cells, 2.0 + 0.05 * cells);
    for (int cell = 0; cell < sphere.size(); ++cell) {
      const Eigen::Vector3d center = sphere.Center(cell);
      ASSERT_NEAR(center.norm(), 1.0, 1e-12);
      ASSERT_EQ(sphere.CellOf(3.0 * center), cell) << "of " << sphere.size();
    }
  }
}

// Directions drawn evenly fall into all cells alike: chi-square with size - 1 degrees of freedom.
TEST(EqualAreaSphere, CellsHaveEqualArea) {
  const EqualAreaSphere sphere(300);
  RandomStream random(1);
  constexpr double kExpected = 1000.0;
  std::vector<int> counts(sphere.size());
  for (int i = 0; i < kExpected * sphere.size(); ++i) {
    ++counts[sphere.CellOf(RandomDirection(random))];
  }
  double chi_square = 0.0;
  for (const int count : counts) chi_square += std::pow(count - kExpected, 2) / kExpected;
  const double freedom = sphere.size() - 1.0;
  EXPECT_NEAR(chi_square, freedom, 4.0 * std::sqrt(2.0 * freedom));
}

TEST(EqualAreaSphere, CellsAreNearlySquare) {
  const EqualAreaSphere sphere = EqualAreaSphere::WithCellAngle(0.1);
  EXPECT_NEAR(sphere.cell_angle(), 0.1, 0.002);
  RandomStream random(2);
  double farthest = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d u = RandomDirection(random);
    farthest = std::max(farthest, std::acos(std::min(1.0, u.dot(sphere.Center(sphere.CellOf(u))))));
  }
  // Half of the diagonal of a square is 0.071; caps at the poles are a little wider.
  EXPECT_LT(farthest, 0.1);
}

TEST(EqualAreaSphere, RefusesWhatIsNoDirection) {
  const EqualAreaSphere sphere(100);
  EXPECT_THROW(sphere.CellOf(Eigen::Vector3d::Zero()), ContractViolation);
  EXPECT_THROW(sphere.Center(sphere.size()), ContractViolation);
  EXPECT_THROW(EqualAreaSphere(1), ContractViolation);
}

}  // namespace
}  // namespace mlvi

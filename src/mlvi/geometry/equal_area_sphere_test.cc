// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/equal_area_sphere.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// Every cell at most once, all that a cap touches, and not much more.
TEST(EqualAreaSphere, RunsCoverACap) {
  RandomStream random(3);
  for (const int cells : {2, 30, 5000}) {
    const EqualAreaSphere sphere(cells);
    for (int trial = 0; trial < 300; ++trial) {
      Eigen::Vector3d middle = RandomDirection(random);
      if (trial % 10 == 0) middle = Eigen::Vector3d(0.0, 0.0, trial % 20 == 0 ? 1.0 : -1.0);
      if (trial % 10 == 1) middle = Eigen::Vector3d(-1.0, 1e-4 * (trial - 150), 0.3).normalized();
      const double angle = random.Uniform(0.01, trial % 3 == 0 ? 3.0 : 0.3);
      std::vector<int> visits(sphere.size());
      int visited = 0;
      sphere.ForEachRun(middle, angle, [&](int first, int end) {
        for (int cell = first; cell < end; ++cell, ++visited) ++visits[cell];
      });
      EXPECT_LE(*std::max_element(visits.begin(), visits.end()), 1);
      for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d axis = middle.cross(RandomDirection(random)).normalized();
        const double off = random.Uniform(0.0, angle);
        const Eigen::Vector3d in_cap = std::cos(off) * middle + std::sin(off) * axis;
        ASSERT_EQ(visits[sphere.CellOf(in_cap)], 1) << middle.transpose() << " " << angle;
      }
      // Away from the poles: the square about the cap, with a cell more on each side.
      const double side = 2.0 * (angle + 1.5 * sphere.cell_angle());
      if (angle < 0.3 && std::abs(middle.z()) < 0.8 && cells == 5000) {
        EXPECT_LT(visited * sphere.area(), 1.2 * side * side);
      }
    }
  }
}

TEST(EqualAreaSphere, RefusesWhatIsNoDirection) {
  const EqualAreaSphere sphere(100);
  EXPECT_THROW(sphere.CellOf(Eigen::Vector3d::Zero()), ContractViolation);
  EXPECT_THROW(sphere.Center(sphere.size()), ContractViolation);
  EXPECT_THROW(EqualAreaSphere(1), ContractViolation);
}

}  // namespace
}  // namespace mlvi

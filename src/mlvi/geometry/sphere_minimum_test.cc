// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/sphere_minimum.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

Eigen::Vector3d NormalVector(RandomStream& random, double sigma) {
  return sigma * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
}

TEST(MinimizeOnSphereTest, BeatsEveryOtherPointOfTheSphere) {
  RandomStream random(12, "sphere");
  for (int trial = 0; trial < 100; ++trial) {
    Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i) A.col(i) = NormalVector(random, trial % 3 == i ? 1e-3 : 1.0);
    const Eigen::Matrix3d H = A * A.transpose();
    const Eigen::Vector3d c = NormalVector(random, 3.0);
    const double radius = 0.1 + 10.0 * random.Uniform();
    const auto cost = [&](const Eigen::Vector3d& g) { return 0.5 * g.dot(H * g) - c.dot(g); };
    const Eigen::Vector3d best = MinimizeOnSphere(H, c, radius);
    EXPECT_NEAR(best.norm(), radius, 1e-12 * radius);
    for (int other = 0; other < 200; ++other) {
      EXPECT_LE(cost(best), cost(radius * NormalVector(random, 1.0).normalized()));
      EXPECT_LE(cost(best), cost(radius * (best + NormalVector(random, 0.01)).normalized()) + 1e-9);
    }
  }
}

}  // namespace
}  // namespace mlvi

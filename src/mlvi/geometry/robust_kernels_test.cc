// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/geometry/robust_kernels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mlvi {
namespace {

template <typename Kernel>
class RobustKernelLaws : public ::testing::Test {};
using Kernels = ::testing::Types<HuberKernel, CauchyKernel, GemanMcClureKernel>;
TYPED_TEST_SUITE(RobustKernelLaws, Kernels);

TYPED_TEST(RobustKernelLaws, LeavesInliersAlone) {
  const TypeParam kernel{.scale = 2.0};
  EXPECT_EQ(kernel.Cost(0.0), 0.0);
  EXPECT_EQ(kernel.Weight(0.0), 1.0);
  EXPECT_NEAR(kernel.Cost(1e-8) / 1e-8, 1.0, 1e-8);
}

TYPED_TEST(RobustKernelLaws, WeightIsTheDerivativeOfTheCost) {
  for (const double scale : {0.5, 1.0, 3.0}) {
    const TypeParam kernel{.scale = scale};
    for (double s = 1e-3; s < 1e4; s *= 1.37) {
      if (std::abs(s - scale * scale) < 1e-2 * s)
        continue;  // Huber's second derivative jumps there
      const double h = 1e-4 * s;
      const double slope = (kernel.Cost(s + h) - kernel.Cost(s - h)) / (2.0 * h);
      EXPECT_NEAR(kernel.Weight(s) / slope, 1.0, 1e-6) << "s " << s << " scale " << scale;
    }
  }
}

TYPED_TEST(RobustKernelLaws, WeightFallsAndCostRises) {
  const TypeParam kernel{.scale = 1.5};
  for (double s = 0.01; s < 1e6; s *= 1.5) {
    EXPECT_LE(kernel.Weight(1.5 * s), kernel.Weight(s));
    EXPECT_GE(kernel.Cost(1.5 * s), kernel.Cost(s));
    EXPECT_LE(kernel.Cost(s), s);
  }
}

TEST(RobustKernels, AgreeWithTheirDefinitions) {
  const double c = 1.7, r = 4.2, s = r * r;
  EXPECT_NEAR(HuberKernel{c}.Cost(s), 2.0 * c * r - c * c, 1e-14);
  EXPECT_NEAR(HuberKernel{c}.Weight(s), c / r, 1e-15);
  EXPECT_NEAR(CauchyKernel{c}.Cost(s), c * c * std::log(1.0 + s / (c * c)), 1e-14);
  EXPECT_NEAR(GemanMcClureKernel{c}.Cost(s), c * c * s / (c * c + s), 1e-14);
  EXPECT_LT(GemanMcClureKernel{c}.Cost(1e12), c * c);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/motion_chain.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

Time At(int step) { return Time::FromSeconds(10.0 + 0.1 * step); }

Pose3 RandomPose(RandomStream& random, double size) {
  const auto vector = [&] {
    return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
  };
  return Pose3(ExpSo3(size * vector()), size * vector());
}

MotionPrior Step(int from, RandomStream& random) {
  MotionPrior step{.from = At(from), .to = At(from + 1), .T_from_to = RandomPose(random, 0.5)};
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = random.Normal();
  step.covariance = 1e-6 * root * root.transpose();
  return step;
}

// The covariance against the scatter of composed motions whose errors are drawn from the steps'
// covariances.
TEST(MotionChain, CovarianceIsThatOfDrawnErrors) {
  RandomStream random(1);
  const MotionPrior first = Step(0, random), second = Step(1, random);
  const MotionPrior both = Compose(first, second);
  const Matrix6d root_first = first.covariance.llt().matrixL(),
                 root_second = second.covariance.llt().matrixL();
  const auto draw = [&](const Matrix6d& root) -> Vector6d {
    Vector6d normal;
    for (int i = 0; i < 6; ++i) normal[i] = random.Normal();
    return root * normal;
  };
  constexpr int kDraws = 20000;
  Matrix6d scatter = Matrix6d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Pose3 drawn =
        BoxPlus(first.T_from_to, draw(root_first)) * BoxPlus(second.T_from_to, draw(root_second));
    const Vector6d error = BoxMinus(drawn, both.T_from_to);
    scatter += error * error.transpose() / kDraws;
  }
  // A sample covariance of n draws is off by about sqrt(2 / n), 1 %, per element.
  EXPECT_LT((scatter - both.covariance).norm(), 0.05 * both.covariance.norm());
}

TEST(MotionChain, LeadsFromTheKeyframeOn) {
  RandomStream random(2);
  MotionChain chain;
  chain.Restart(At(0));
  EXPECT_FALSE(chain.To(At(0)));
  Pose3 expected;
  for (int i = 0; i < 5; ++i) {
    const MotionPrior step = Step(i, random);
    expected = expected * step.T_from_to;
    chain.Extend(step);
  }
  const auto motion = chain.To(At(5));
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->from, At(0));
  EXPECT_LT(BoxMinus(motion->T_from_to, expected).norm(), 1e-12);
  EXPECT_FALSE(chain.To(At(4)));
}

TEST(MotionChain, AMissingStepBreaksItUntilTheNextKeyframe) {
  RandomStream random(3);
  MotionChain chain;
  chain.Restart(At(0));
  chain.Extend(Step(0, random));
  chain.Extend(Step(2, random));
  chain.Extend(Step(3, random));
  EXPECT_FALSE(chain.To(At(4)));
  chain.Restart(At(4));
  chain.Extend(Step(4, random));
  EXPECT_TRUE(chain.To(At(5)));
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/preintegration.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/base/error.h"
#include "mlvi/imu/imu_testing.h"
#include "mlvi/imu/propagation.h"

namespace mlvi {
namespace {

using testing::AddImuNoise;
using testing::kGravity;
using testing::NormalVector;
using testing::TestImu;
using testing::Walk;

const ImuBias kBias{.accelerometer = {0.05, -0.08, 0.1}, .gyroscope = {0.01, -0.02, 0.015}};

// [p, v, R] of `a` minus those of `b`.
Eigen::Matrix<double, 9, 1> DeltaMinus(const PreintegratedImu& a, const PreintegratedImu& b) {
  Eigen::Matrix<double, 9, 1> d;
  d << a.delta_p - b.delta_p, a.delta_v - b.delta_v, LogSo3(b.delta_R.conjugate() * a.delta_R);
  return d;
}

// Error of the state predicted over [from, to] from perfect samples at `rate_hz`.
Vector15d PredictionError(const Walk& walk, double from, double to, double rate_hz) {
  const auto delta = Preintegrate(walk.Samples(from, to, rate_hz), ImuBias(), TestImu());
  return BoxMinus(Predict(walk.State(from), delta, kGravity), walk.State(to));
}

TEST(PreintegrationTest, ReproducesAWalkWithSecondOrderAccuracy) {
  const Walk walk;
  const Vector15d coarse = PredictionError(walk, 0.2, 1.2, 100.0),
                  fine = PredictionError(walk, 0.2, 1.2, 200.0);
  EXPECT_LT(fine.segment<3>(nav_index::kPosition).norm(), 1e-3);
  EXPECT_LT(fine.segment<3>(nav_index::kRotation).norm(), 1e-4);
  // Halving the interval must quarter the error.
  EXPECT_NEAR(coarse.norm() / fine.norm(), 4.0, 0.2);
}

TEST(PreintegrationTest, IsExactOnConstantRateAndForce) {
  // Rotation about z at rate w with specific force [a, 0, h] in the body:
  //   v = [a sin(wt), a (1 - cos wt)] / w, p = a [(1 - cos wt) / w^2, t / w - sin(wt) / w^2], z as
  //   in free flight.
  const double w = 2.5, a = 3.0, h = 4.0, t = 0.8;
  for (const int count : {2, 9, 161}) {
    std::vector<ImuSample> samples;
    for (int k = 0; k < count; ++k) {
      samples.push_back({Walk::At(t * k / (count - 1)), {0.0, 0.0, w}, {a, 0.0, h}});
    }
    const auto delta = Preintegrate(samples, ImuBias(), TestImu());
    const double s = std::sin(w * t), c = std::cos(w * t);
    EXPECT_LT(LogSo3(delta.delta_R.conjugate() * ExpSo3({0.0, 0.0, w * t})).norm(), 1e-12);
    EXPECT_LT((delta.delta_v - Eigen::Vector3d(a * s / w, a * (1 - c) / w, h * t)).norm(), 1e-12);
    EXPECT_LT((delta.delta_p -
               Eigen::Vector3d(a * (1 - c) / (w * w), a * (t / w - s / (w * w)), 0.5 * h * t * t))
                  .norm(),
              1e-12);
  }
}

TEST(PreintegrationTest, BiasJacobiansMatchNumericDifferentiation) {
  const auto samples = Walk().Samples(0.0, 0.7, 100.0);
  const auto delta = Preintegrate(samples, kBias, TestImu());
  Eigen::Matrix<double, 9, 6> analytic;
  analytic << delta.dp_dba, delta.dp_dbg, delta.dv_dba, delta.dv_dbg, Eigen::Matrix3d::Zero(),
      delta.dR_dbg;
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 6; ++i) {
    ImuBias plus = kBias, minus = kBias;
    (i < 3 ? plus.accelerometer : plus.gyroscope)(i % 3) += kStep;
    (i < 3 ? minus.accelerometer : minus.gyroscope)(i % 3) -= kStep;
    const auto numeric = ((DeltaMinus(Preintegrate(samples, plus, TestImu()), delta) -
                           DeltaMinus(Preintegrate(samples, minus, TestImu()), delta)) /
                          (2.0 * kStep))
                             .eval();
    EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-8) << "bias component " << i;
  }
}

TEST(PreintegrationTest, BiasJacobiansHoldAcrossAGap) {
  // One interval of half a second with 1.5 rad of rotation: series and derivatives far from zero.
  const std::vector<ImuSample> samples{{Walk::At(0.0), {1.0, -2.0, 1.5}, {3.0, 1.0, 9.0}},
                                       {Walk::At(0.5), {1.5, -2.5, 0.5}, {-1.0, 2.0, 8.0}}};
  const auto delta = Preintegrate(samples, kBias, TestImu());
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 3; ++i) {
    ImuBias plus = kBias, minus = kBias;
    plus.gyroscope(i) += kStep;
    minus.gyroscope(i) -= kStep;
    const auto numeric = ((DeltaMinus(Preintegrate(samples, plus, TestImu()), delta) -
                           DeltaMinus(Preintegrate(samples, minus, TestImu()), delta)) /
                          (2.0 * kStep))
                             .eval();
    EXPECT_LT((delta.dp_dbg.col(i) - numeric.head<3>()).norm(), 1e-9);
    EXPECT_LT((delta.dv_dbg.col(i) - numeric.segment<3>(3)).norm(), 1e-9);
    EXPECT_LT((delta.dR_dbg.col(i) - numeric.tail<3>()).norm(), 1e-9);
  }
}

TEST(PreintegrationTest, CorrectionForBiasEqualsReintegrationToSecondOrder) {
  const auto samples = Walk().Samples(0.0, 0.5, 200.0);
  const auto delta = Preintegrate(samples, kBias, TestImu());
  const auto difference = [&](double scale) {
    const ImuBias other{
        .accelerometer = kBias.accelerometer + scale * Eigen::Vector3d(0.1, 0.2, -0.1),
        .gyroscope = kBias.gyroscope + scale * Eigen::Vector3d(0.02, -0.01, 0.02)};
    return DeltaMinus(CorrectedForBias(delta, other), Preintegrate(samples, other, TestImu()))
        .norm();
  };
  // The terms left out: |d_bg t|^2 g t / 2 and |d_ba| |d_bg| t^2 / 2.
  EXPECT_LT(difference(1.0), 1.5e-3);
  EXPECT_NEAR(difference(1.0) / difference(0.5), 4.0, 0.2);
}

TEST(PreintegrationTest, PartsComposeToTheWhole) {
  const auto samples = Walk().Samples(0.0, 1.0, 200.0);
  const std::span<const ImuSample> all(samples);
  const auto whole = Preintegrate(all, kBias, TestImu());
  const auto first = Preintegrate(all.first(81), kBias, TestImu());
  const auto second = Preintegrate(all.subspan(80), kBias, TestImu());
  EXPECT_LT(LogSo3(whole.delta_R.conjugate() * first.delta_R * second.delta_R).norm(), 1e-12);
  EXPECT_LT((first.delta_v + first.delta_R * second.delta_v - whole.delta_v).norm(), 1e-12);
  EXPECT_LT(
      (first.delta_p + first.delta_v * second.dt() + first.delta_R * second.delta_p - whole.delta_p)
          .norm(),
      1e-12);
}

TEST(PreintegrationTest, CutBetweenSamplesComposesToTheWhole) {
  const auto samples = Walk().Samples(0.0, 1.0, 200.0);
  const NavState start = Walk().State(0.0);
  const Time cut = Walk::At(0.4321), end = Walk::At(1.0);
  const auto whole = Predict(start, Preintegrate(samples, ImuBias(), TestImu()), kGravity);
  const auto first = Preintegrate(SamplesBetween(samples, start.stamp, cut), ImuBias(), TestImu());
  const auto second = Preintegrate(SamplesBetween(samples, cut, end), ImuBias(), TestImu());
  // Only the rule within the one interval that is cut differs, by its third-order error.
  EXPECT_LT(BoxMinus(Predict(Predict(start, first, kGravity), second, kGravity), whole).norm(),
            1e-5);
}

TEST(PreintegrationTest, CovarianceMatchesMonteCarlo) {
  const ImuSpec imu = TestImu();
  const auto clean = Walk().Samples(0.0, 1.0, imu.rate_hz);
  const auto truth = Preintegrate(clean, ImuBias(), imu);
  constexpr int kTrials = 800;
  RandomStream random(7, "preintegration");
  Matrix15d sampled = Matrix15d::Zero();
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto noisy = clean;
    const ImuBias last = AddImuNoise(imu, kBias, random, noisy);
    const auto delta = Preintegrate(noisy, kBias, imu);
    Vector15d error;
    error << DeltaMinus(truth, delta), last.accelerometer - kBias.accelerometer,
        last.gyroscope - kBias.gyroscope;
    nees += error.dot(delta.covariance.llt().solve(error)) / kTrials;
    sampled += error * error.transpose() / kTrials;
  }
  EXPECT_NEAR(nees, 15.0, 4.0 * std::sqrt(2.0 * 15.0 / kTrials));
  // Each variance by itself: a chi-square of kTrials degrees.
  const Matrix15d covariance = Preintegrate(clean, ImuBias(), imu).covariance;
  for (int i = 0; i < 15; ++i) {
    EXPECT_NEAR(sampled(i, i) / covariance(i, i), 1.0, 4.5 * std::sqrt(2.0 / kTrials))
        << "component " << i;
  }
}

TEST(PreintegrationTest, CovarianceOfASingleIntervalIsRegular) {
  const auto delta = Preintegrate(Walk().Samples(0.0, 0.005, 200.0), ImuBias(), TestImu());
  ASSERT_EQ(delta.samples, 2);
  EXPECT_EQ(delta.covariance.llt().info(), Eigen::Success);
}

TEST(PreintegrationTest, GapsAreCoveredByTheirNoise) {
  const ImuSpec imu = TestImu();
  const Walk walk;
  double nees = 0.0;
  int count = 0;
  for (const double gap : {0.05, 0.1, 0.2, 0.5}) {
    for (double from = 0.0; from < 4.0; from += 0.37, ++count) {
      auto samples = walk.Samples(from, from + 1.0, imu.rate_hz);
      std::erase_if(samples, [&](const ImuSample& sample) {
        const double t = Walk::Seconds(sample.stamp) - from;
        return t > 0.3 && t < 0.3 + gap;
      });
      const auto delta = Preintegrate(samples, ImuBias(), imu);
      const auto truth = Preintegrate(walk.Samples(from, from + 1.0, imu.rate_hz), ImuBias(), imu);
      const auto error = DeltaMinus(truth, delta);
      nees += error.dot(
          Eigen::Matrix<double, 9, 9>(delta.covariance.topLeftCorner<9, 9>()).llt().solve(error));
    }
  }
  // The walk is milder than the motion allowed for; the model must cover it, but not by more than a
  // factor of ten.
  EXPECT_LT(nees / count, 9.0);
  EXPECT_GT(nees / count, 9.0 / 100.0);
}

// Estimates in the middle of a gap, at instants of sweeps and keyframes, take nothing of its noise.
TEST(PreintegrationTest, AGapThatIsCutIsAsUncertainAsTheWholeOne) {
  const ImuSpec imu = TestImu();
  auto samples = Walk().Samples(0.0, 1.0, imu.rate_hz);
  std::erase_if(samples, [](const ImuSample& sample) {
    const double t = Walk::Seconds(sample.stamp);
    return t > 0.3 && t < 0.8;
  });
  const auto variances = [&](int parts) {
    Matrix15d covariance = Matrix15d::Zero();
    NavState state = Walk().State(0.0);
    for (int k = 0; k < parts; ++k) {
      const auto part =
          SamplesBetween(samples, Walk::At(1.0 * k / parts), Walk::At((k + 1.0) / parts));
      const Propagation propagation = Propagate(state, covariance, part, imu, kGravity);
      state = propagation.states.back();
      covariance = propagation.covariance;
    }
    return Eigen::Vector2d(covariance.block<3, 3>(6, 6).trace(),
                           covariance.block<3, 3>(3, 3).trace());
  };
  const Eigen::Vector2d whole = variances(1);
  for (const int parts : {2, 5, 20}) {
    // Of rotation exactly; of velocity it matters when in the gap the body turns.
    EXPECT_NEAR(variances(parts)[0] / whole[0], 1.0, 0.02) << parts;
    EXPECT_NEAR(variances(parts)[1] / whole[1], 1.0, 0.5) << parts;
  }
}

TEST(PreintegrationTest, SaturatedAxesLoseTheirWeightOthersDoNot) {
  ImuSpec imu = TestImu();
  imu.gyroscope_saturation = 2.0;
  auto samples = Walk().Samples(0.0, 0.2, imu.rate_hz);
  const auto clean = Preintegrate(samples, ImuBias(), imu);
  samples[10].angular_velocity.x() = 2.0;
  const auto saturated = Preintegrate(samples, ImuBias(), imu);
  constexpr int x = nav_index::kRotation;
  EXPECT_GT(saturated.covariance(x, x), 10.0 * clean.covariance(x, x));
  // One radian per second, one sigma, over the two intervals that the sample takes part in.
  const auto rotation_variance = [](const PreintegratedImu& delta) {
    return Eigen::Matrix3d(delta.covariance.block<3, 3>(x, x)).trace();
  };
  EXPECT_NEAR(rotation_variance(saturated) - rotation_variance(clean),
              2.0 * std::pow(1.0 / imu.rate_hz, 2), 1e-9);
}

TEST(SamplesBetweenTest, InterpolatesBothEndsAndHoldsBeyondThem) {
  const std::vector<ImuSample> samples{{Walk::At(1.0), {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}},
                                       {Walk::At(2.0), {2.0, 0.0, 0.0}, {0.0, 2.0, 0.0}},
                                       {Walk::At(3.0), {3.0, 0.0, 0.0}, {0.0, 3.0, 0.0}}};
  const auto inner = SamplesBetween(samples, Walk::At(1.25), Walk::At(2.5));
  ASSERT_EQ(inner.size(), 3U);
  EXPECT_EQ(inner.front().stamp, Walk::At(1.25));
  EXPECT_NEAR(inner.front().angular_velocity.x(), 1.25, 1e-12);
  EXPECT_EQ(inner[1].stamp, Walk::At(2.0));
  EXPECT_NEAR(inner.back().linear_acceleration.y(), 2.5, 1e-12);
  const auto exact = SamplesBetween(samples, Walk::At(1.0), Walk::At(3.0));
  ASSERT_EQ(exact.size(), 3U);
  EXPECT_EQ(exact.back().angular_velocity, samples.back().angular_velocity);
  const auto outer = SamplesBetween(samples, Walk::At(0.5), Walk::At(3.5));
  ASSERT_EQ(outer.size(), 5U);
  EXPECT_EQ(outer.front().stamp, Walk::At(0.5));
  EXPECT_EQ(outer.front().angular_velocity.x(), 1.0);
  EXPECT_EQ(outer.back().angular_velocity.x(), 3.0);
  EXPECT_EQ(SamplesBetween(samples, Walk::At(4.0), Walk::At(5.0)).size(), 2U);
  EXPECT_TRUE(SamplesBetween(samples, Walk::At(2.0), Walk::At(2.0)).empty());
  EXPECT_TRUE(SamplesBetween({}, Walk::At(1.0), Walk::At(2.0)).empty());
}

TEST(PreintegrationTest, RejectsBrokenContracts) {
  auto samples = Walk().Samples(0.0, 0.1, 200.0);
  std::swap(samples[3], samples[4]);
  EXPECT_THROW(Preintegrate(samples, ImuBias(), TestImu()), ContractViolation);
  EXPECT_THROW(Preintegrate({}, ImuBias(), TestImu()), ContractViolation);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mlvi/base/random.h"
#include "mlvi/eval/chi_square.h"
#include "mlvi/eval/evaluation.h"
#include "mlvi/eval/nees.h"

namespace mlvi {
namespace {

Time At(double seconds) { return Time::FromSeconds(seconds); }

Pose3 PoseAt(double t) {
  return Pose3(ExpSo3({0.1 * std::sin(t), 0.2 * std::cos(t), 0.3 * t}),
               {4.0 * std::cos(0.5 * t), 4.0 * std::sin(0.5 * t), 0.2 * t});
}

// PoseAt every `step` s in [from, to].
Trajectory Path(double from, double to, double step) {
  Trajectory trajectory;
  for (int i = 0; from + i * step <= to + 1e-9; ++i) {
    trajectory.push_back({.stamp = At(from + i * step), .pose = PoseAt(from + i * step)});
  }
  return trajectory;
}

PoseMatrices Matrices(const Trajectory& trajectory) {
  PoseMatrices matrices;
  for (const StampedPose& p : trajectory) matrices.emplace_back(p.pose.matrix());
  return matrices;
}

TEST(ErrorStatistics, OfKnownValues) {
  const std::vector<double> errors = {4.0, 1.0, 2.0, 3.0};
  const ErrorStatistics s = Summarize(errors);
  EXPECT_EQ(s.count, 4U);
  EXPECT_DOUBLE_EQ(s.sse, 30.0);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(1.25));
  EXPECT_EQ(s.min, 1.0);
  EXPECT_EQ(s.max, 4.0);
  EXPECT_NEAR(s.rmse * s.rmse, s.mean * s.mean + s.std * s.std, 1e-14);
  EXPECT_THROW(Summarize({}), ContractViolation);
}

TEST(Association, NearestAgreesWithSearchingAll) {
  RandomStream random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Trajectory a, b;
    for (int i = 0; i < 60; ++i)
      a.push_back(
          {.stamp = At(random.Uniform(0.0, 5.0)), .pose = Pose3::FromTranslation({1.0 * i, 0, 0})});
    for (int i = 0; i < 90; ++i)
      b.push_back(
          {.stamp = At(random.Uniform(0.0, 5.0)), .pose = Pose3::FromTranslation({0, 1.0 * i, 0})});
    const MatchedPoses matched =
        Associate(a, b, {.kind = AssociationKind::kNearest, .max_difference = 0.02}).value();
    std::size_t expected = 0;
    for (const StampedPose& p : a) {
      const auto nearest = std::min_element(b.begin(), b.end(), [&](const auto& x, const auto& y) {
        return std::abs((x.stamp - p.stamp).nanoseconds()) <
               std::abs((y.stamp - p.stamp).nanoseconds());
      });
      if (std::abs((nearest->stamp - p.stamp).seconds()) > 0.02) continue;
      ++expected;
      const auto found =
          std::find_if(matched.estimate.begin(), matched.estimate.end(),
                       [&](const auto& m) { return m.translation() == p.pose.translation(); });
      ASSERT_NE(found, matched.estimate.end());
      EXPECT_EQ(
          matched.truth[static_cast<std::size_t>(found - matched.estimate.begin())].translation(),
          nearest->pose.translation());
    }
    EXPECT_EQ(matched.stamps.size(), expected);
  }
}

TEST(Association, InterpolationFollowsTheDenserTrajectory) {
  const Trajectory estimate = Path(0.013, 9.9, 0.1), truth = Path(0.0, 10.0, 0.005);
  for (const bool swapped : {false, true}) {
    const MatchedPoses matched =
        swapped ? Associate(truth, estimate, {}).value() : Associate(estimate, truth, {}).value();
    ASSERT_EQ(matched.stamps.size(), estimate.size());
    for (std::size_t i = 0; i < matched.stamps.size(); ++i) {
      // Linear interpolation over 5 ms: |p''| h^2 / 8 = 1 * 2.5e-5 / 8.
      ASSERT_LT((matched.estimate[i].matrix() - matched.truth[i].matrix()).norm(), 1e-5);
    }
  }
}

TEST(Association, BridgesNoLongGaps) {
  Trajectory truth = Path(0.0, 4.0, 0.01);
  const Trajectory late = Path(6.0, 10.0, 0.01);
  truth.insert(truth.end(), late.begin(), late.end());
  const MatchedPoses matched = Associate(Path(0.005, 9.995, 0.1), truth, {}).value();
  // Beside the gap a pose is near enough (max_difference) to interpolate from: at 4.005 s.
  for (const Time stamp : matched.stamps) EXPECT_TRUE(stamp <= At(4.01) || stamp >= At(5.99));
  EXPECT_EQ(matched.stamps.size(), 81U);
}

// Rounding of stamps in files must not cost a match, however sparse the poses.
TEST(Association, SparsePosesWithRoundedStampsMatch) {
  Trajectory estimate = Path(0.0, 20.0, 0.5);
  for (StampedPose& p : estimate) p.stamp = p.stamp + Duration::FromNanoseconds(400);
  const MatchedPoses matched = Associate(estimate, Path(0.0, 20.0, 0.5), {}).value();
  EXPECT_GE(matched.stamps.size(), 40U);  // the last one lies beyond the truth
}

TEST(Association, AnOffsetIsTakenOut) {
  Trajectory estimate = Path(0.0, 5.0, 0.1);
  for (StampedPose& p : estimate) p.stamp = p.stamp + Duration::FromSeconds(1000.25);
  AssociationOptions options;
  options.estimate_offset = Duration::FromSeconds(-1000.25);
  const Evaluation result = Evaluate(estimate, Path(0.0, 5.0, 0.1),
                                     {.association = options, .alignment = AlignmentKind::kNone})
                                .value();
  EXPECT_EQ(result.matched, 51U);
  EXPECT_LT(result.absolute_translation.max, 1e-12);
}

TEST(Association, ErrorsTellRangesAndCauses) {
  const Trajectory early = Path(0.0, 5.0, 0.1), late = Path(100.0, 105.0, 0.1);
  const Error apart = Associate(early, late, {}).error();
  EXPECT_EQ(apart.kind, ErrorKind::kInput);
  for (const char* text :
       {"[0.000000000, 5.000000000]", "[100.000000000, 105.000000000]", "differs by 100.000"}) {
    EXPECT_THAT(apart.message, ::testing::HasSubstr(text));
  }
  const AssociationOptions strict{.kind = AssociationKind::kNearest, .max_difference = 0.01};
  EXPECT_THAT(Associate(Path(0.05, 5.0, 0.1), early, strict).error().message,
              ::testing::HasSubstr("0.0500 s apart"));
  EXPECT_FALSE(Associate({}, early, {}));
  EXPECT_FALSE(Associate(early, {}, {}));
  Trajectory broken = early;
  broken[3].pose = Pose3::FromTranslation({0.0, std::nan(""), 0.0});
  EXPECT_THAT(Associate(broken, early, {}).error().message,
              ::testing::HasSubstr("at stamp 0.300000000"));
  EXPECT_THAT(AssociateByIndex(Matrices(early), Matrices(Path(0.0, 4.0, 0.1))).error().message,
              ::testing::HasSubstr("51 poses in the estimate, 41 in the truth"));
}

TEST(PoseErrors, OfAKnownOffset) {
  const PoseMatrices truth = Matrices(Path(0.0, 10.0, 0.1));
  PoseMatrices estimate = truth;
  const Eigen::Isometry3d error(Pose3(ExpSo3({0.0, 0.03, 0.0}), {0.3, 0.0, 0.4}).matrix());
  for (Eigen::Isometry3d& pose : estimate) pose = pose * error;
  const PoseErrors absolute = AbsoluteErrors(estimate, truth);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    ASSERT_NEAR(absolute.translation[i], 0.5, 1e-12);
    ASSERT_NEAR(absolute.rotation[i], 0.03, 1e-12);
  }
}

// Alignment undoes a change of the world frame; relative errors and drift do not see it at all.
TEST(PoseErrors, DoNotDependOnTheWorldFrame) {
  const Trajectory truth = Path(0.0, 20.0, 0.05);
  RandomStream random(3);
  Trajectory estimate = truth, moved;
  for (StampedPose& p : estimate) {
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise[k] = 0.02 * random.Normal();
    p.pose = BoxPlus(p.pose, noise);
  }
  const Pose3 frame(ExpSo3({1.0, -0.5, 2.0}), {100.0, 50.0, -20.0});
  for (const StampedPose& p : estimate) moved.push_back({.stamp = p.stamp, .pose = frame * p.pose});
  const Evaluation a = Evaluate(estimate, truth, {}).value(),
                   b = Evaluate(moved, truth, {}).value();
  EXPECT_NEAR(a.absolute_translation.rmse, b.absolute_translation.rmse, 1e-10);
  EXPECT_NEAR(a.absolute_rotation->rmse, b.absolute_rotation->rmse, 1e-10);
  EXPECT_NEAR(a.relative_translation->rmse, b.relative_translation->rmse, 1e-10);
  ASSERT_EQ(a.drift.size(), 5U);
  EXPECT_NEAR(a.drift[0].translation_percent, b.drift[0].translation_percent, 1e-9);
  // 0.02 m per axis; sqrt(3) 0.02 known to 1 / sqrt(2 * 3 * 401), four sigma.
  EXPECT_NEAR(a.absolute_translation.rmse, 0.02 * std::sqrt(3.0),
              0.0346 * 4.0 / std::sqrt(6.0 * 401.0));
}

TEST(PoseErrors, EachAlignmentRemovesItsOwnPart) {
  const Trajectory truth = Path(0.0, 20.0, 0.05);
  const auto rmse = [&](const Similarity3& S, AlignmentKind kind) {
    Trajectory estimate;
    for (const StampedPose& p : truth) estimate.push_back({.stamp = p.stamp, .pose = S * p.pose});
    return Evaluate(estimate, truth, {.alignment = kind}).value().absolute_translation.rmse;
  };
  const Similarity3 yaw{.scale = 1.0, .pose = Pose3(ExpSo3({0, 0, 1.0}), {1, 2, 3})};
  const Similarity3 tilt{.scale = 1.0, .pose = Pose3(ExpSo3({0.2, 0, 1.0}), {1, 2, 3})};
  const Similarity3 scaled{.scale = 1.2, .pose = tilt.pose};
  EXPECT_GT(rmse(yaw, AlignmentKind::kNone), 1.0);
  EXPECT_LT(rmse(yaw, AlignmentKind::kYaw), 1e-10);
  EXPECT_GT(rmse(tilt, AlignmentKind::kYaw), 0.1);
  EXPECT_LT(rmse(tilt, AlignmentKind::kSe3), 1e-10);
  EXPECT_GT(rmse(scaled, AlignmentKind::kSe3), 0.1);
  EXPECT_LT(rmse(scaled, AlignmentKind::kSim3), 1e-10);
}

TEST(PoseErrors, TheTruthsOwnFrameIsAccountedFor) {
  const Pose3 T_body_prism(ExpSo3({0.1, 0.2, 0.3}), {0.05, -0.1, 0.4});
  const Trajectory estimate = Path(0.0, 20.0, 0.05);
  Trajectory truth;
  for (const StampedPose& p : estimate)
    truth.push_back({.stamp = p.stamp, .pose = p.pose * T_body_prism});
  EXPECT_GT(Evaluate(estimate, truth, {}).value().absolute_rotation->rmse, 0.1);
  const Evaluation result = Evaluate(estimate, truth, {.T_body_truth = T_body_prism}).value();
  EXPECT_LT(result.absolute_translation.max, 1e-10);
  EXPECT_LT(result.absolute_rotation->max, 1e-10);
}

TEST(PoseErrors, PositionOnlyTruthGivesPositionErrorsOnly) {
  const Trajectory estimate = Path(0.0, 20.0, 0.05);
  Trajectory truth = estimate;
  for (StampedPose& p : truth) {
    p.pose = Pose3::FromTranslation(p.pose.translation());
    p.has_rotation = false;
  }
  const Evaluation result = Evaluate(estimate, truth, {}).value();
  EXPECT_LT(result.absolute_translation.max, 1e-10);
  EXPECT_FALSE(result.has_rotations);
  EXPECT_FALSE(result.absolute_rotation || result.relative_translation || result.relative_rotation);
  EXPECT_TRUE(result.drift.empty());
}

// A straight walk with an odometer that reads 2 % too long: drift and relative errors are 2 %, at
// every length.
TEST(Drift, OfAScaledOdometer) {
  PoseMatrices truth, estimate;
  for (int i = 0; i <= 1000; ++i) {
    truth.emplace_back(Eigen::Translation3d(0.1 * i, 0.0, 0.0));
    estimate.emplace_back(Eigen::Translation3d(0.102 * i, 0.0, 0.0));
  }
  const std::vector<SegmentDrift> drift = Drift(estimate, truth, {10.0, 50.0, 200.0});
  ASSERT_EQ(drift.size(), 2U);  // 200 m do not fit in 100 m
  for (const SegmentDrift& d : drift) {
    // A segment ends at the first pose beyond its length, up to one step of 0.1 m late.
    EXPECT_GE(d.translation_percent, 2.0 - 1e-9);
    EXPECT_LE(d.translation_percent, 2.0 * (1.0 + 0.1 / d.length) + 1e-9);
    EXPECT_LT(d.rotation_deg_per_metre, 1e-12);
  }
  EXPECT_NEAR(static_cast<double>(drift[0].count), 901.0, 1.0);
}

TEST(SelectPairs, HoldTheirLength) {
  const Trajectory path = Path(0.0, 30.0, 0.05);
  const PoseMatrices poses = Matrices(path);
  std::vector<Time> stamps;
  for (const StampedPose& p : path) stamps.push_back(p.stamp);
  const std::vector<double> distance = CumulativeDistance(poses);
  const double step = *std::max_element(distance.begin() + 1, distance.end()) /
                      static_cast<double>(poses.size() - 1) * 2.0;
  const auto consecutive = SelectPairs(poses, stamps, {.delta = 1.5}).value();
  ASSERT_GT(consecutive.size(), 20U);
  for (std::size_t k = 0; k < consecutive.size(); ++k) {
    const auto [i, j] = consecutive[k];
    EXPECT_EQ(i, k == 0 ? 0U : consecutive[k - 1].second);
    EXPECT_GE(distance[j] - distance[i], 1.5);
    EXPECT_LT(distance[j - 1] - distance[i], 1.5);
  }
  const auto all = SelectPairs(poses, stamps, {.delta = 1.5, .all_pairs = true}).value();
  EXPECT_GT(all.size(), poses.size() / 2);
  for (const auto& [i, j] : all) EXPECT_NEAR(distance[j] - distance[i], 1.5, step);
  const auto timed =
      SelectPairs(poses, stamps, {.delta = 2.0, .unit = DeltaUnit::kSeconds}).value();
  for (const auto& [i, j] : timed) {
    EXPECT_NEAR((stamps[j] - stamps[i]).seconds(), 2.0, 1e-6);
  }
  const auto frames =
      SelectPairs(poses, {}, {.delta = 7.0, .unit = DeltaUnit::kFrames, .all_pairs = true}).value();
  EXPECT_EQ(frames.size(), poses.size() - 7);
  for (const auto& [i, j] : frames) EXPECT_EQ(j, i + 7);
  EXPECT_EQ(SelectPairs(poses, stamps, {.delta = 1.5, .skip_first = true}).value().size(),
            consecutive.size() - 1);
}

TEST(SelectPairs, RefusesWhatMakesNoSense) {
  const PoseMatrices poses = Matrices(Path(0.0, 5.0, 0.1));
  for (const RelativeErrorOptions& options :
       {RelativeErrorOptions{.delta = 0.0}, RelativeErrorOptions{.delta = -1.0},
        RelativeErrorOptions{.delta = 1.5, .unit = DeltaUnit::kFrames},
        RelativeErrorOptions{.delta = 1.0, .unit = DeltaUnit::kSeconds}}) {
    const auto pairs = SelectPairs(poses, {}, options);
    ASSERT_FALSE(pairs);
    EXPECT_EQ(pairs.error().kind, ErrorKind::kConfiguration);
  }
  // Longer than the trajectory: no pairs, and a result without relative errors rather than zeros.
  const Evaluation result = Evaluate(poses, poses, {.relative = {.delta = 1e4}}).value();
  EXPECT_TRUE(result.relative_pairs.empty());
  EXPECT_FALSE(result.relative_translation);
}

TEST(Coverage, CountsWhatTheEstimateDescribes) {
  const Trajectory truth = Path(0.0, 100.0, 0.5);
  EXPECT_EQ(ComputeCoverage(truth, truth, 1.0, {}).share, 1.0);
  const Coverage stopped = ComputeCoverage(Path(0.0, 40.0, 0.1), truth, 1.0, {});
  EXPECT_NEAR(stopped.share, 0.4, 1e-9);
  ASSERT_EQ(stopped.gaps.size(), 1U);
  EXPECT_EQ(stopped.gaps[0].from, At(40.0));
  EXPECT_EQ(stopped.gaps[0].to, At(100.0));

  Trajectory holed = Path(10.0, 40.0, 0.1);
  const Trajectory rest = Path(60.0, 130.0, 0.1);
  holed.insert(holed.end(), rest.begin(), rest.end());
  const Coverage coverage = ComputeCoverage(holed, truth, 1.0, {});
  EXPECT_NEAR(coverage.covered, 70.0, 1e-6);
  EXPECT_EQ(coverage.gaps.size(), 2U);

  EXPECT_EQ(ComputeCoverage(Path(200.0, 210.0, 0.1), truth, 1.0, {}).share, 0.0);
  EXPECT_EQ(
      ComputeCoverage(Path(200.0, 300.0, 0.1), truth, 1.0, Duration::FromSeconds(-200.0)).share,
      1.0);
}

// Tables of the chi-square distribution (Abramowitz and Stegun 26.8), and its normal limit.
TEST(ChiSquare, QuantilesOfTheTables) {
  EXPECT_NEAR(ChiSquareQuantile(0.95, 1), 3.841459, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 2), 5.991465, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 3), 7.814728, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.99, 6), 16.811894, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.025, 6), 1.237344, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.975, 6), 14.449375, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.05, 10), 3.940299, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.975, 100), 129.561197, 1e-6);
  EXPECT_NEAR(ChiSquareQuantile(0.5, 2), 2.0 * std::log(2.0), 1e-10);
  // Wilson and Hilferty (1931) is good to 1e-6 for many degrees of freedom.
  for (const double dof : {1e4, 1e6}) {
    const double h = 2.0 / (9.0 * dof),
                 expected = dof * std::pow(1.0 - h + 1.959963985 * std::sqrt(h), 3);
    EXPECT_NEAR(ChiSquareQuantile(0.975, dof) / expected, 1.0, 1e-6);
  }
  for (double p = 0.001; p < 1.0; p += 0.037) {
    for (const double dof : {1.0, 2.0, 5.5, 60.0, 3000.0}) {
      EXPECT_NEAR(ChiSquareProbability(ChiSquareQuantile(p, dof), dof), p, 1e-10);
    }
  }
}

// Errors drawn from the covariance that is claimed are consistent; others are found out.
TEST(Nees, TellsTooSureFromTooCautious) {
  RandomStream random(5);
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 0.01 * random.Normal();
  root.diagonal().array() += 0.02;
  const Matrix6d covariance = root * root.transpose();
  std::vector<double> honest, sure;
  for (int i = 0; i < 2000; ++i) {
    Vector6d unit;
    for (int k = 0; k < 6; ++k) unit[k] = random.Normal();
    const Pose3 estimate = PoseAt(0.1 * i);
    const Pose3 truth = BoxPlus(estimate, root * unit);
    honest.push_back(PoseNees(estimate, truth, covariance).value());
    sure.push_back(PoseNees(estimate, truth, 0.5 * covariance).value());
  }
  // One seed in twenty falls out of a 95 % band; this one does not.
  EXPECT_TRUE(SummarizeNees(honest, 6).consistent()) << SummarizeNees(honest, 6).mean;
  EXPECT_NEAR(SummarizeNees(honest, 6).low, 6.0 - 1.96 * std::sqrt(12.0 / 2000.0), 0.01);
  EXPECT_GT(SummarizeNees(sure, 6).mean, SummarizeNees(sure, 6).high);
  Matrix6d singular = covariance;
  singular.row(2).setZero();
  singular.col(2).setZero();
  EXPECT_FALSE(PoseNees(Pose3(), Pose3(), singular));
}

}  // namespace
}  // namespace mlvi

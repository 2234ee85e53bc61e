// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/relative_translation.h"

#include <gtest/gtest.h>

#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

constexpr double kSigma = 1.0 / 350.0;  // rad, a pixel of a 720 x 540 fisheye

struct Scene {
  Eigen::Quaterniond R;
  Eigen::Vector3d t;
  std::vector<RayPair> pairs;
  std::vector<bool> outlier;
};

struct SceneOptions {
  int count = 200;
  double translation = 0.1, rotation = 0.1, offset = 0.1;
  double near = 2.0, far = 15.0;
  double noise = 0.5;  // px
  double outliers = 0.0;
};

Eigen::Vector3d Disturbed(const Eigen::Vector3d& direction, double sigma, RandomStream& random) {
  const Eigen::Vector2d noise(random.Normal(), random.Normal());
  return (direction + TangentBasis(direction) * (sigma * noise)).normalized();
}

// Points all around, each tracked by one of four cameras `offset` m from S; outliers end 4 to 30 px
// off.
Scene MakeScene(RandomStream& random, const SceneOptions& o) {
  Scene s;
  s.R = ExpSo3(o.rotation * test::RandomDirection(random));
  s.t = o.translation * test::RandomDirection(random);
  for (int i = 0; i < o.count; ++i) {
    const double azimuth = 0.5 * std::numbers::pi * (i % 4);
    const Eigen::Vector3d axis(std::cos(azimuth), std::sin(azimuth), 0.0);
    const Eigen::Vector3d C = o.offset * axis;
    const Eigen::Vector3d direction = (axis + 0.6 * test::RandomDirection(random)).normalized();
    const Eigen::Vector3d point = random.Uniform(o.near, o.far) * direction;
    RayPair pair;
    pair.first = {C, Disturbed((point - C).normalized(), o.noise * kSigma, random),
                  o.noise * kSigma};
    const Eigen::Vector3d seen = s.R.conjugate() * (point - s.t);
    pair.second = {C, Disturbed((seen - C).normalized(), o.noise * kSigma, random),
                   o.noise * kSigma};
    const bool outlier = random.Uniform() < o.outliers;
    if (outlier) {
      const double angle = 2.0 * std::numbers::pi * random.Uniform();
      const Eigen::Vector2d off(std::cos(angle), std::sin(angle));
      pair.second.direction =
          (pair.second.direction +
           TangentBasis(pair.second.direction) * (random.Uniform(4.0, 30.0) * kSigma * off))
              .normalized();
    }
    s.pairs.push_back(pair);
    s.outlier.push_back(outlier);
  }
  return s;
}

TEST(PairError, VanishesAtTheTruthAndSeesWhatCannotBe) {
  RandomStream random(1);
  const Scene s = MakeScene(random, {.rotation = 0.0, .noise = 1e-9});
  const Eigen::Matrix3d R = s.R.toRotationMatrix();
  for (RayPair pair : s.pairs) {
    pair.first.sigma = pair.second.sigma = kSigma;
    EXPECT_LT(SquaredPairError(pair, R, s.t, 0.2), 1e-12);
    // Points nearer than 20 m do not lie in front when the motion is turned around, nor that near
    // that a tenth of the baseline would do.
    const double parallax = pair.first.direction.cross(R * pair.second.direction).norm();
    if (parallax < 10.0 * kSigma) continue;
    EXPECT_GT(SquaredPairError(pair, R, -s.t, 0.2), 1.0);
    EXPECT_GT(SquaredPairError(pair, R, 1e-3 * s.t, 0.2), 1.0);
  }
}

TEST(PairError, IsChiSquareDistributed) {
  RandomStream random(2);
  double sum = 0.0;
  int count = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Scene s = MakeScene(random, {.count = 500, .translation = 0.3, .near = 2.0, .far = 6.0});
    for (const RayPair& pair : s.pairs) {
      sum += SquaredPairError(pair, s.R.toRotationMatrix(), s.t, 0.0);
      ++count;
    }
  }
  // One degree of freedom; parallax near zero is cut off and adds a little. 10000 values: sigma of
  // the mean 0.014.
  EXPECT_NEAR(sum / count, 1.0, 0.08);
}

TEST(RelativeTranslation, FindsOutliersAmongAllCameras) {
  RandomStream random(3);
  int kept = 0, wrong = 0, inliers = 0, lost = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const Scene s = MakeScene(random, {.outliers = 0.3});
    const auto result = EstimateRelativeTranslation(s.pairs, s.R, std::nullopt, {});
    ASSERT_EQ(result.inliers.size(), s.pairs.size());
    for (std::size_t i = 0; i < s.pairs.size(); ++i) {
      // An error along the epipolar line is another depth: no relative pose can tell.
      const bool visible = SquaredPairError(s.pairs[i], s.R.toRotationMatrix(), s.t, 0.2) > 16.0;
      kept += result.inliers[i] != 0;
      wrong += result.inliers[i] != 0 && s.outlier[i] && visible;
      inliers += !s.outlier[i];
      lost += result.inliers[i] == 0 && !s.outlier[i];
    }
  }
  EXPECT_LT(wrong, 0.01 * kept);
  EXPECT_LT(lost, 0.03 * inliers);
  EXPECT_GT(kept, 0.95 * inliers);
}

// Bearings are claimed to 0.5 px, which serves the worst images; among pairs that agree to 0.1 px an
// error of 1.5 px across the epipolar line is no inlier. With noise as claimed it may be one.
TEST(RelativeTranslation, TheLimitFollowsTheScatterOfThePairs) {
  RandomStream random(8);
  for (const double noise : {0.1, 0.5}) {
    int off = 0, off_kept = 0, others = 0, others_kept = 0;
    for (int trial = 0; trial < 20; ++trial) {
      Scene s = MakeScene(random, {.noise = noise});
      std::vector<bool> moved(s.pairs.size());
      for (std::size_t i = 0; i < s.pairs.size(); ++i) {
        RayPair& pair = s.pairs[i];
        pair.first.sigma = pair.second.sigma = 0.5 * kSigma;
        moved[i] = i % 10 == 0;
        if (!moved[i]) continue;
        const Eigen::Vector3d f = s.R * pair.second.direction;
        const Eigen::Vector3d c = s.t + s.R * pair.second.origin - pair.first.origin;
        const Eigen::Vector3d across = s.R.conjugate() * c.cross(f).normalized();
        pair.second.direction = (pair.second.direction + 1.5 * kSigma * across).normalized();
      }
      const auto result = EstimateRelativeTranslation(s.pairs, s.R, s.t, {});
      for (std::size_t i = 0; i < s.pairs.size(); ++i) {
        (moved[i] ? off : others) += 1;
        (moved[i] ? off_kept : others_kept) += result.inliers[i];
      }
    }
    EXPECT_GT(others_kept, 0.99 * others) << noise;
    // 1.5 px less 0.5 sqrt(2) px of noise, limit 3 x 0.71 px: four of five are below.
    if (noise < 0.3) {
      EXPECT_LT(off_kept, 0.02 * off);
    } else {
      EXPECT_GT(off_kept, 0.5 * off);
    }
  }
}

TEST(RelativeTranslation, FindsTheDirectionWithoutPrediction) {
  RandomStream random(4);
  std::vector<double> angles;
  for (int trial = 0; trial < 50; ++trial) {
    const Scene s = MakeScene(random, {.outliers = 0.2});
    const auto result = EstimateRelativeTranslation(s.pairs, s.R, std::nullopt, {});
    angles.push_back(std::acos(result.t_first_second.normalized().dot(s.t.normalized())));
  }
  std::sort(angles.begin(), angles.end());
  // 0.5 px of noise over 160 pairs of 5 px parallax: about 1 degree.
  EXPECT_LT(angles[angles.size() / 2], 0.03);
  EXPECT_LT(angles.back(), 0.15);
}

// Offsets and rotation tell the metric length of the translation: the generalised camera's gift.
TEST(RelativeTranslation, FindsTheLengthWhereOffsetsTellIt) {
  RandomStream random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Scene s = MakeScene(random, {.translation = 0.3,
                                       .rotation = 0.8,
                                       .offset = 0.3,
                                       .near = 1.0,
                                       .far = 4.0,
                                       .noise = 0.1});
    const auto result = EstimateRelativeTranslation(s.pairs, s.R, std::nullopt, {});
    const Eigen::Vector3d error = result.t_first_second - s.t;
    EXPECT_LT(error.norm(), 0.02);
    EXPECT_LT(error.dot(result.information * error), 21.1);  // chi-square, 3 degrees, 1e-4
  }
}

TEST(RelativeTranslation, PureRotationKeepsAllPairs) {
  RandomStream random(6);
  const Scene s =
      MakeScene(random, {.translation = 0.0, .rotation = 0.3, .offset = 0.0, .outliers = 0.2});
  const auto result = EstimateRelativeTranslation(s.pairs, s.R, std::nullopt, {});
  for (std::size_t i = 0; i < s.pairs.size(); ++i) {
    if (s.outlier[i]) {
      EXPECT_EQ(result.inliers[i], 0) << i;
    }
  }
  EXPECT_GT(result.inlier_count, 0.75 * static_cast<double>(s.pairs.size()));
  EXPECT_LT(result.t_first_second.norm(), 0.01);
}

TEST(RelativeTranslation, GivesTheSameBitsAndEndsWithFewPairs) {
  RandomStream random(7);
  Scene s = MakeScene(random, {.outliers = 0.3});
  const auto a = EstimateRelativeTranslation(s.pairs, s.R, s.t, {});
  const auto b = EstimateRelativeTranslation(s.pairs, s.R, s.t, {});
  EXPECT_EQ(a.t_first_second, b.t_first_second);
  EXPECT_EQ(a.inliers, b.inliers);
  for (const std::size_t count : {3, 2, 1, 0}) {
    s.pairs.resize(count);
    const auto few = EstimateRelativeTranslation(s.pairs, s.R, s.t, {});
    EXPECT_EQ(few.inliers.size(), count);
    EXPECT_TRUE(few.t_first_second.allFinite());
  }
}

}  // namespace
}  // namespace mlvi

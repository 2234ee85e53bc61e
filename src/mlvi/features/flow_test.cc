// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/flow.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/core/utility.hpp>

#include "mlvi/base/parallel.h"
#include "mlvi/features/corners.h"
#include "mlvi/features/testing.h"

namespace mlvi {
namespace {

constexpr int kWidth = 320, kHeight = 240;

// A known warp: where the point of the first image lies in the second one. p' = A (p - centre) +
// centre + shift.
struct Warp {
  std::string label;
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();

  static Eigen::Vector2d Center() { return {0.5 * kWidth, 0.5 * kHeight}; }
  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const {
    return A * (p - Center()) + Center() + shift;
  }
  Eigen::Vector2d Inverse(const Eigen::Vector2d& p) const {
    return A.inverse() * (p - Center() - shift) + Center();
  }
};
void PrintTo(const Warp& warp, std::ostream* out) { *out << warp.label; }

struct Pair {
  ImagePyramid first, second;
  std::vector<Eigen::Vector2d> points;
};

Pair MakePair(const Warp& warp, double noise, const PyramidConfig& config, std::uint64_t seed = 1) {
  const test::WaveTexture texture(seed);
  const RandomStream random(seed, "noise");
  Pair pair;
  pair.first = BuildPyramid(
      test::Render(
          kWidth, kHeight, texture, [](const auto& p) { return p; }, noise, random.Fork(1)),
      config);
  pair.second =
      BuildPyramid(test::Render(
                       kWidth, kHeight, texture, [&](const auto& p) { return warp.Inverse(p); },
                       noise, random.Fork(2)),
                   config);
  RegionMap tiles(kWidth, kHeight);
  for (int row = 0; row < tiles.rows(); ++row) {
    for (int column = 0; column < tiles.columns(); ++column) {
      tiles.At(column, row) = (row / 3) * ((tiles.columns() + 2) / 3) + column / 3;
    }
  }
  for (const Corner& corner :
       DetectCorners(pair.first, tiles, std::vector<std::uint8_t>(200, 1), {})) {
    const Eigen::Vector2d goal = warp(corner.pixel);
    const bool inside =
        goal.x() > 12 && goal.y() > 12 && goal.x() < kWidth - 13 && goal.y() < kHeight - 13;
    if (inside) pair.points.push_back(corner.pixel);
  }
  return pair;
}

struct Outcome {
  double median_px = 0.0;
  double tracked = 0.0;  // share
  double wrong = 0.0;    // share of the tracked ones that are more than 1 px off
};

Outcome Track(const Pair& pair, const Warp& warp, const PyramidConfig& config,
              const Eigen::Vector2d& prediction_error) {
  std::vector<FlowRequest> requests;
  for (const auto& p : pair.points) requests.push_back({p, warp(p) + prediction_error});
  const auto results = TrackFlow(pair.first, pair.second, requests, config, {});
  std::vector<double> errors;
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].status != FlowStatus::kTracked) continue;
    errors.push_back((results[i].pixel - warp(pair.points[i])).norm());
  }
  Outcome outcome;
  outcome.tracked = static_cast<double>(errors.size()) / static_cast<double>(results.size());
  if (errors.empty()) return outcome;
  std::sort(errors.begin(), errors.end());
  outcome.median_px = errors[errors.size() / 2];
  outcome.wrong =
      static_cast<double>(errors.end() - std::upper_bound(errors.begin(), errors.end(), 1.0)) /
      static_cast<double>(errors.size());
  return outcome;
}

Eigen::Matrix2d Turn(double angle, double scale) {
  return scale * Eigen::Rotation2Dd(angle).toRotationMatrix();
}

class KnownWarp : public ::testing::TestWithParam<Warp> {};

// The task sets 0.15 px; this is what white noise of 2 grey values and 8-bit pictures allow with
// room to spare.
TEST_P(KnownWarp, IsMeasuredToATenthOfAPixel) {
  const PyramidConfig config;
  const Pair pair = MakePair(GetParam(), 2.0, config);
  ASSERT_GT(pair.points.size(), 60U);
  const Outcome outcome = Track(pair, GetParam(), config, {1.5, -2.0});
  EXPECT_LT(outcome.median_px, 0.1);
  EXPECT_GT(outcome.tracked, 0.9);
  EXPECT_LT(outcome.wrong, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Warps, KnownWarp,
                         ::testing::Values(Warp{"none"}, Warp{"half_pixel", Turn(0, 1), {0.5, 0.5}},
                                           Warp{"shift", Turn(0, 1), {7.3, -4.8}},
                                           Warp{"far", Turn(0, 1), {41.2, 17.7}},
                                           Warp{"turn", Turn(0.05, 1.0), {2.2, 1.1}},
                                           Warp{"zoom", Turn(0, 1.04), {0.3, 0.4}},
                                           Warp{"turn_and_zoom", Turn(-0.04, 0.97), {-6.4, 3.6}}),
                         [](const auto& parameter) { return parameter.param.label; });

// Errors follow the noise: half of it, half of the error.
TEST(Flow, ErrorsComeFromTheNoise) {
  const Warp warp{"shift", Turn(0.0, 1.0), {3.37, -2.71}};
  const PyramidConfig config;
  const double low = Track(MakePair(warp, 1.0, config), warp, config, {0, 0}).median_px;
  const double high = Track(MakePair(warp, 8.0, config), warp, config, {0, 0}).median_px;
  EXPECT_LT(low, 0.04);
  EXPECT_GT(high, 3.0 * low);
  EXPECT_LT(high, 0.25);
}

// The prediction of the IMU is what makes fast turns trackable.
TEST(Flow, FollowsFarMotionOnlyWithPrediction) {
  const Warp warp{"far", Turn(0.0, 1.0), {70.0, 25.0}};
  const PyramidConfig config;
  const Pair pair = MakePair(warp, 2.0, config);
  EXPECT_GT(Track(pair, warp, config, {3.0, -3.0}).tracked, 0.9);
  const Outcome blind = Track(pair, warp, config, -warp.shift);
  EXPECT_LT(blind.tracked * (1.0 - blind.wrong), 0.5);
}

TEST(Flow, TheWayBackFindsFalseMatches) {
  // A picture that has nothing to do with the first one.
  const PyramidConfig config;
  Pair pair = MakePair({"none"}, 2.0, config, 1);
  pair.second = MakePair({"none"}, 2.0, config, 2).first;
  EXPECT_LT(Track(pair, {"none"}, config, {0, 0}).tracked, 0.2);
}

TEST(Flow, NoTextureIsNotTracked) {
  const PyramidConfig config;
  const Image grey{.width = 64, .height = 64, .pixels = std::vector<std::uint8_t>(64 * 64, 90)};
  const ImagePyramid pyramid = BuildPyramid(grey, config);
  const FlowRequest request{{30.0, 30.0}, {30.0, 30.0}};
  const auto result = TrackFlow(pyramid, pyramid, std::vector<FlowRequest>{request}, config, {});
  EXPECT_EQ(result.at(0).status, FlowStatus::kLost);
  EXPECT_TRUE(TrackFlow(pyramid, pyramid, {}, config, {}).empty());
}

TEST(Flow, HasTheSameBitsAtAnyNumberOfThreads) {
  const Warp warp{"turn", Turn(0.03, 1.0), {2.2, 1.1}};
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    PyramidConfig config;
    config.equalise = true;
    const Pair pair = MakePair(warp, 2.0, config);
    std::vector<FlowRequest> requests;
    for (const auto& p : pair.points) requests.push_back({p, p});
    return TrackFlow(pair.first, pair.second, requests, config, {});
  };
  const auto one = run(1), two = run(2);
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].pixel, two[i].pixel);
    EXPECT_EQ(one[i].status, two[i].status);
    EXPECT_EQ(one[i].round_trip_px, two[i].round_trip_px);
  }
}

// Where the picture is dark, equalisation brings tracks back that would have had no texture.
TEST(Flow, EqualisationFollowsWhatIsDark) {
  const test::WaveTexture texture(3);
  const auto dark = [&](const Eigen::Vector2d& p) { return 20.0 + 0.12 * (texture(p) - 128.0); };
  const auto image = test::Render(
      kWidth, kHeight, dark, [](const auto& p) { return p; }, 0.3, RandomStream(3));
  const auto corners = [&](bool equalise) {
    PyramidConfig config;
    config.equalise = equalise;
    RegionMap tiles(kWidth, kHeight);
    for (int row = 0; row < tiles.rows(); ++row) {
      for (int column = 0; column < tiles.columns(); ++column) {
        tiles.At(column, row) = (row / 5) * 8 + column / 5;
      }
    }
    return DetectCorners(BuildPyramid(image, config), tiles, std::vector<std::uint8_t>(48, 1), {});
  };
  // Contrast is raised up to equalise_clip = 3 times: of 42 cells few have a corner before, most
  // after.
  EXPECT_LT(corners(false).size(), 10U);
  EXPECT_GT(corners(true).size(), 25U);
}

}  // namespace
}  // namespace mlvi

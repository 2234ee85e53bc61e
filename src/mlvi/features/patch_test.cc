// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/features/patch.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "mlvi/features/testing.h"

namespace mlvi {
namespace {

constexpr int kWidth = 200, kHeight = 160;
const Eigen::Vector2d kMiddle(100.0, 80.0);

struct View {
  Eigen::Matrix2d warp = Eigen::Matrix2d::Identity();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double gain = 1.0, offset = 0.0;  // of grey values
  double noise = 2.0;               // grey values
};

// The texture seen so that its point p lies at middle + warp (p - middle) + shift.
ImagePyramid Show(const View& view, std::uint64_t seed) {
  const test::WaveTexture texture(3);
  const auto changed = [&](const Eigen::Vector2d& p) {
    return view.gain * texture(p) + view.offset;
  };
  const Eigen::Matrix2d back = view.warp.inverse();
  const auto source = [&](const Eigen::Vector2d& q) -> Eigen::Vector2d {
    return kMiddle + back * (q - kMiddle - view.shift);
  };
  return BuildPyramid(
      test::Render(kWidth, kHeight, changed, source, view.noise, RandomStream(seed)), {});
}

// Errors (px) of windows on a grid of points at odd fractions of pixels, found from guesses that
// are up to 1 px off; sorted. Those not found are left out.
std::vector<double> Errors(const View& view, const PatchConfig& config = {}) {
  const ImagePyramid first = Show({.noise = view.noise}, 1), second = Show(view, 2);
  RandomStream random(5);
  std::vector<double> errors;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d p(50.3 + 9.7 * (i % 10), 50.6 + 9.9 * (i / 10));
    const auto patch = Patch::Cut(first, p, config);
    if (!patch) continue;
    const Eigen::Vector2d truth = kMiddle + view.warp * (p - kMiddle) + view.shift;
    const Eigen::Vector2d guess =
        truth + 0.7 * Eigen::Vector2d(random.Uniform(-1.0, 1.0), random.Uniform(-1.0, 1.0));
    const auto match = patch->Align(second, view.warp, guess, config);
    if (!match || !match->converged) continue;
    EXPECT_GT(match->correlation, 0.8);
    errors.push_back((match->pixel - truth).norm());
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

void ExpectAccurate(const View& view, double median, double worst) {
  const std::vector<double> errors = Errors(view);
  ASSERT_GT(errors.size(), 50U);
  EXPECT_LT(errors[errors.size() / 2], median);
  EXPECT_LT(errors.back(), worst);
}

// Noise of 2 grey values in both images, slopes of about 10 per px over 169 px: 0.02 px per axis.
// Interpolation between pixels adds about as much.
TEST(Patch, IsFoundToSmallFractionsOfAPixel) {
  ExpectAccurate({.shift = {3.37, -2.81}}, 0.06, 0.3);
}

TEST(Patch, IsFoundUnderAKnownWarp) {
  View view{.shift = {1.4, 0.3}};
  view.warp << 1.15, 0.20, -0.25, 0.90;
  ExpectAccurate(view, 0.06, 0.3);
}

TEST(Patch, IsFoundInAnotherLight) {
  ExpectAccurate({.shift = {-2.2, 1.6}, .gain = 0.6, .offset = 30.0}, 0.08, 0.4);
}

TEST(Patch, AWarpThatIsNotToldIsFound) {
  View view{.shift = {0.5, 0.5}};
  view.warp << 1.08, 0.05, -0.05, 1.10;
  const ImagePyramid first = Show({}, 1), second = Show(view, 2);
  std::vector<double> errors, warp_errors;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d p(50.0 + 9.7 * (i % 10), 50.0 + 9.9 * (i / 10));
    const auto patch = Patch::Cut(first, p, {});
    const Eigen::Vector2d truth = kMiddle + view.warp * (p - kMiddle) + view.shift;
    const auto match = patch->Align(second, Eigen::Matrix2d::Identity(), truth, {});
    if (!match || !match->converged) continue;
    errors.push_back((match->pixel - truth).norm());
    warp_errors.push_back((match->warp - view.warp).norm());
  }
  ASSERT_GT(errors.size(), 50U);
  std::sort(errors.begin(), errors.end());
  std::sort(warp_errors.begin(), warp_errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.06);
  EXPECT_LT(warp_errors[warp_errors.size() / 2], 0.03);
}

// The prior on the warp holds the result, however many steps are taken: with a sigma of a thousandth
// a stretch by a tenth is not believed, with one of a half it is.
TEST(Patch, AWarpIsHeldToWhatIsPredicted) {
  View view;
  view.warp << 1.10, 0.0, 0.0, 1.10;
  const ImagePyramid first = Show({}, 1), second = Show(view, 2);
  const auto stretch = [&](double warp_sigma) {
    PatchConfig config;
    config.warp_sigma = warp_sigma;
    config.step_px = 1e-5;  // so that all steps are taken
    config.max_iterations = 100;
    const auto patch = Patch::Cut(first, kMiddle, config);
    const auto match = patch->Align(second, Eigen::Matrix2d::Identity(), kMiddle, config);
    return match ? (match->warp - Eigen::Matrix2d::Identity()).norm() : -1.0;
  };
  EXPECT_LT(stretch(1e-3), 0.01);
  EXPECT_GE(stretch(1e-3), 0.0);
  EXPECT_NEAR(stretch(0.5), (view.warp - Eigen::Matrix2d::Identity()).norm(), 0.02);
}

// Errors squared in sigmas, per axis, of windows under `view` that alignments from the truth make:
// the mean over windows at whole pixels with white noise in their own image alone, so that no
// interpolation makes noise of neighbours alike.
double MeanSquareInSigmas(const View& view, double noise) {
  PatchConfig config;
  config.warp_sigma = 1.0;  // as good as unknown: the truth would be told otherwise
  const ImagePyramid second = Show(view, 1);
  double squares = 0.0;
  int count = 0;
  for (std::uint64_t seed = 2; seed < 6; ++seed) {
    const ImagePyramid first = Show({.noise = noise}, seed);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d p(40.0 + 13.0 * (i % 10), 35.0 + 10.0 * (i / 10));
      const Eigen::Vector2d truth = kMiddle + view.warp * (p - kMiddle) + view.shift;
      const auto patch = Patch::Cut(first, p, config);
      const auto match =
          patch ? patch->Align(second, view.warp, truth, config) : std::optional<PatchMatch>();
      if (!match || !match->converged) continue;
      const Eigen::Vector2d error = match->pixel - truth;
      squares += 0.5 * error.dot(match->covariance.inverse() * error);
      ++count;
    }
  }
  EXPECT_GT(count, 200);
  return squares / count;
}

// Errors are as large as alignments say, also where the match is larger than the window or sheared:
// uncertainty is told in pixels of the image in which the match lies. Expected is 1.05 (eight
// unknowns fit away 1/21 of what the noise leaves over 169 pixels), and 0.2 more because slopes are
// those of the noisy window; 400 windows scatter by 0.05. Told in pixels of the window, it would be
// 1.7 times that under the zoom, 1.6 times under the shear.
TEST(Patch, TellsItsOwnUncertainty) {
  View zoomed{.noise = 0.0}, sheared{.noise = 0.0};
  zoomed.warp *= 1.3;
  sheared.warp << 1.2, 0.6, 0.0, 1.2;
  for (const View& view : {View{.noise = 0.0}, zoomed, sheared}) {
    const double mean = MeanSquareInSigmas(view, 3.0);
    EXPECT_GT(mean, 0.85) << view.warp;
    EXPECT_LT(mean, 1.5) << view.warp;
  }
}

TEST(Patch, NeedsTextureAndRoom) {
  Image plain{.width = 50, .height = 50, .pixels = std::vector<std::uint8_t>(2500, 90)};
  for (int x = 0; x < 50; ++x) plain.pixels[static_cast<std::size_t>(50 * 20 + x)] = 200;
  const ImagePyramid image = BuildPyramid(plain, {});
  EXPECT_FALSE(Patch::Cut(image, {25.0, 40.0}, {}));  // nothing
  EXPECT_FALSE(Patch::Cut(image, {25.0, 20.0}, {}));  // a line: free to slide along
  const ImagePyramid textured = Show({}, 1);
  EXPECT_FALSE(Patch::Cut(textured, {3.0, 80.0}, {}));
  EXPECT_FALSE(Patch::Cut(textured, {100.0, 158.0}, {}));
  const auto patch = Patch::Cut(textured, kMiddle, {});
  ASSERT_TRUE(patch);
  EXPECT_FALSE(patch->Align(textured, Eigen::Matrix2d::Identity(), {2.0, 2.0}, {}));
}

TEST(Patch, ElsewhereCorrelatesLittleOrIsNotFound) {
  const ImagePyramid image = Show({}, 1);
  const auto patch = Patch::Cut(image, kMiddle, {});
  ASSERT_TRUE(patch);
  int wrong = 0;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector2d elsewhere(40.0 + 4.0 * i, 40.0 + 27.0 * (i % 3));
    if ((elsewhere - kMiddle).norm() < 8.0) continue;
    const auto match = patch->Align(image, Eigen::Matrix2d::Identity(), elsewhere, {});
    wrong +=
        match && match->converged && match->correlation > PatchConfig{}.min_correlation ? 1 : 0;
  }
  EXPECT_LE(wrong, 1);
}

}  // namespace
}  // namespace mlvi

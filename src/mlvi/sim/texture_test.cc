// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/sim/texture_patterns.h"

namespace mlvi {
namespace {

constexpr float kStep = 1.0F / 65535.0F;  // of the stored values

std::vector<Eigen::Vector3f> RandomTexels(int size) {
  RandomStream random(1, "texels");
  std::vector<Eigen::Vector3f> texels(static_cast<std::size_t>(size) *
                                      static_cast<std::size_t>(size));
  for (Eigen::Vector3f& t : texels)
    for (int k = 0; k < 3; ++k) t[k] = static_cast<float>(random.Uniform());
  return texels;
}

TEST(Texture, GivesItsTexelsAtTheirCentresAndRepeats) {
  constexpr int kSize = 8;
  const auto texels = RandomTexels(kSize);
  const Texture texture(kSize, texels);
  for (int row = 0; row < kSize; ++row) {
    for (int column = 0; column < kSize; ++column) {
      const float u = (static_cast<float>(column) + 0.5F) / kSize;
      const float v = (static_cast<float>(row) + 0.5F) / kSize;
      const Eigen::Vector3f& expected = texels[static_cast<std::size_t>(row * kSize + column)];
      EXPECT_LT((texture.Sample(u, v, 0.0F) - expected).norm(), 2.0F * kStep);
      EXPECT_LT((texture.Sample(u - 3.0F, v + 2.0F, 0.0F) - expected).norm(), 1e-4F);
    }
  }
  // No seam: continuous across the border of the image.
  EXPECT_LT((texture.Sample(-1e-5F, 0.3F, 0.0F) - texture.Sample(1e-5F, 0.3F, 0.0F)).norm(), 1e-3F);
}

TEST(Texture, EveryLevelKeepsTheMean) {
  const auto texels = RandomTexels(16);
  const Texture texture(16, texels);
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const auto& t : texels) mean += t / 256.0F;
  ASSERT_EQ(texture.levels(), 5);
  EXPECT_LT((texture.Sample(0.1F, 0.7F, 4.0F) - mean).norm(), 5.0F * kStep);
  EXPECT_LT((texture.Sample(0.1F, 0.7F, 99.0F) - mean).norm(), 5.0F * kStep);
  // Between levels: linear.
  const Eigen::Vector3f a = texture.Sample(0.1F, 0.7F, 1.0F), b = texture.Sample(0.1F, 0.7F, 2.0F);
  EXPECT_LT((texture.Sample(0.1F, 0.7F, 1.25F) - (0.75F * a + 0.25F * b)).norm(), 1e-6F);
}

// What grey cameras see of a texture does not depend on whether its colours are kept.
TEST(Texture, GreyIsTheLuminanceOfTheColours) {
  const auto texels = RandomTexels(32);
  const Texture colour(32, texels), grey(32, texels, TextureTint::kGrey);
  EXPECT_EQ(grey.mean(), colour.mean());
  EXPECT_NEAR(grey.mean(), 0.5F, 0.02F);
  RandomStream random(2, "places");
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] { return static_cast<float>(random.Uniform(-2.0, 2.0)); };
    const Eigen::Vector2f uv(number(), number()), stretch(0.1F * number(), 0.1F * number());
    const float lod = 1.5F * (number() + 2.0F);
    const Eigen::Vector3f a = colour.Mean(uv, stretch, 1 + i % 4, lod),
                          b = grey.Mean(uv, stretch, 1 + i % 4, lod);
    ASSERT_NEAR(kLuminanceWeights.dot(a), b.x(), 2.0F * kStep);
    ASSERT_TRUE((b.array() == b.x()).all());
  }
}

TEST(Texture, RefusesSizesThatHaveNoPyramid) {
  EXPECT_THROW(Texture(6, RandomTexels(6)), ContractViolation);
  EXPECT_THROW(Texture(8, RandomTexels(4)), ContractViolation);
}

class Patterns : public ::testing::TestWithParam<int> {};

TEST_P(Patterns, AreWithinTheirColoursSeamlessAndFollowTheSeed) {
  TextureRecipe recipe{.pattern = static_cast<TexturePattern>(GetParam())};
  constexpr int kSize = 256;
  const Texture texture = DrawTexture(recipe, kSize), same = DrawTexture(recipe, kSize);
  recipe.seed = 2;
  const Texture other = DrawTexture(recipe, kSize);
  double sum = 0.0, squares = 0.0, seam = 0.0, inside = 0.0, difference = 0.0;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      const float u = (static_cast<float>(j) + 0.5F) / kSize,
                  v = (static_cast<float>(i) + 0.5F) / kSize;
      const Eigen::Vector3f t = texture.Sample(u, v, 0.0F);
      ASSERT_EQ(t, same.Sample(u, v, 0.0F));
      ASSERT_TRUE((t.array() >= 0.0F).all() && (t.array() <= 1.0F).all());
      sum += t.mean();
      squares += t.mean() * t.mean();
      difference += (t - other.Sample(u, v, 0.0F)).cwiseAbs().mean();
    }
    const float v = (static_cast<float>(i) + 0.5F) / kSize, half = 0.5F / kSize;
    seam += (texture.Sample(half, v, 0.0F) - texture.Sample(1.0F - half, v, 0.0F)).norm();
    inside += (texture.Sample(0.4F + half, v, 0.0F) - texture.Sample(0.4F - half, v, 0.0F)).norm();
  }
  constexpr double kTexels = kSize * kSize;
  const double mean = sum / kTexels, deviation = std::sqrt(squares / kTexels - mean * mean);
  if (recipe.pattern == TexturePattern::kPlain) {
    EXPECT_LT(deviation, 1e-4);
    return;
  }
  EXPECT_GT(mean, 0.05);
  EXPECT_GT(deviation, 0.004) << NameOf(recipe.pattern);
  EXPECT_GT(difference / kTexels, 0.001) << "the seed changes nothing";
  // Joints of slabs and bricks may lie on the border; a seam of random grey would be far more.
  EXPECT_LT(seam / kSize, 0.25 + 3.0 * inside / kSize) << NameOf(recipe.pattern);
}

INSTANTIATE_TEST_SUITE_P(All, Patterns, ::testing::Range(0, 20));

}  // namespace
}  // namespace mlvi

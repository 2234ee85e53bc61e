// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_refiner.h"

#include <gtest/gtest.h>

#include "mlvi/features/testing.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

constexpr int kSize = 120;

// A texture seen twice from the same place, with fresh noise.
class Refiner : public ::testing::Test {
 protected:
  ImagePyramid Draw(double noise, std::uint64_t seed) const {
    const test::WaveTexture texture(3);
    return BuildPyramid(test::Render(
                            kSize, kSize, texture, [](const Eigen::Vector2d& p) { return p; },
                            noise, RandomStream(seed)),
                        PyramidConfig{});
  }
  // What becomes of a place that flow found `off` px beside the true one.
  Refinement Refine(double off, double noise) const {
    const ImagePyramid first = Draw(noise, 1), second = Draw(noise, 2);
    TrackRefiner refiner({});
    const TrackId id(0);
    const Eigen::Vector2d place(60.3, 58.8);
    refiner.Start(id, *model_.Lift(0, place), first);
    const auto found = model_.Lift(0, place + Eigen::Vector2d(off, 0.0));
    const RefinementRequest request{.track = id, .observation = *found, .change = {}};
    const ImagePyramid* images[] = {&second};
    Refinement result = refiner.Refine(model_, {&request, 1}, images).front();
    MLVI_CHECK(result.observation.has_value(), "not aligned from {} px off", off);
    const double error = (result.observation->pixel - place).norm();
    EXPECT_LT(error, 0.05 + 0.05 * noise);  // 0.34 px under noise of 12 grey values
    return result;
  }
  PanoramaModel model_ =
      test::MakePanorama(test::RingRig(1, 0.0, test::MakeWideCamera(1.5, kSize)));
};

TEST_F(Refiner, FlowThatWentElsewhereIsContradicted) {
  // 0.8 px, of which alignment under this noise errs by less than 0.1.
  for (const double off : {0.0, 0.3, 0.6, -0.6}) EXPECT_FALSE(Refine(off, 2.0).contradicts) << off;
  for (const double off : {1.0, 1.5, -1.2}) EXPECT_TRUE(Refine(off, 2.0).contradicts) << off;
}

// Uncertainty follows what is left of the difference to the window, within its limits.
TEST_F(Refiner, ObservationsSayHowUncertainTheyAre) {
  const double clean = Refine(0.2, 0.5).observation->sigma_scale;
  const double noisy = Refine(0.2, 12.0).observation->sigma_scale;
  EXPECT_EQ(clean, 0.5);
  EXPECT_GT(noisy, 2.0 * clean);
  EXPECT_LE(noisy, 4.0);
}

}  // namespace
}  // namespace mlvi

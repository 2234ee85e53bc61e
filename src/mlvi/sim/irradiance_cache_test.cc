// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/irradiance_cache.h"

#include <gtest/gtest.h>

#include <numbers>

#include "mlvi/sim/mesh_builder.h"
#include "mlvi/sim/sky.h"

namespace mlvi {
namespace {

// A level square of 20 x 20 m around the origin.
TriangleMesh Floor() {
  MeshBuilder builder;
  builder.AddQuad({-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0},
                  builder.AddMaterial("floor", 0.5));
  return std::move(builder).Finish();
}

IrradianceCache::Irradiance Under(const World& world, const IrradianceCache& cache,
                                  const Eigen::Vector3d& point) {
  const auto hit = world.Cast(point + 0.5 * Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), 1);
  return cache.At(hit.value().triangle, hit->barycentric, hit->normal);
}

TEST(IrradianceCache, OpenGroundGetsTheWholeSky) {
  const World world(Floor(), {.sun_illuminance = 0.0, .sky_illuminance = 10000.0});
  const IrradianceCache cache(world, {0.3F});
  EXPECT_NEAR(Under(world, cache, {1.0, 2.0, 0.0}).sky, 10000.0, 700.0);  // clouds
  EXPECT_LT(Under(world, cache, {1.0, 2.0, 0.0}).lamps, 1e-6);
}

TEST(IrradianceCache, AWallTakesHalfOfTheSky) {
  MeshBuilder builder;
  const MaterialId black = builder.AddMaterial("black", 0.5);
  builder.AddQuad({-10, -10, 0}, {10, -10, 0}, {10, 0, 0}, {-10, 0, 0}, black);
  builder.AddQuad({-10, 0, 0}, {10, 0, 0}, {10, 0, 20}, {-10, 0, 20}, black);
  const World world(std::move(builder).Finish(),
                    {.sun_illuminance = 0.0, .sky_illuminance = 1000.0});
  const IrradianceCache cache(world, {0.0F});
  EXPECT_NEAR(Under(world, cache, {0.0, -0.1, 0.0}).sky, 500.0, 80.0);
}

TEST(IrradianceCache, LampsFollowTheInverseSquareOfTheDistance) {
  const double intensity = 400.0, height = 3.0;
  const World world(Floor(), {.sun_illuminance = 0.0,
                              .sky_illuminance = 0.0,
                              .lamps = {{.position = {0.0, 0.0, height}, .intensity = intensity}}});
  const IrradianceCache cache(world, {0.0F});
  for (const double x : {0.0, 0.8, 2.0, 5.0}) {
    const double distance = std::hypot(x, height);
    const double expected = intensity * height / (distance * distance * distance);
    // Interpolated between nodes 0.3 m apart.
    EXPECT_NEAR(Under(world, cache, {x, 0.01, 0.0}).lamps, expected, 0.02 * expected) << x;
  }
}

TEST(IrradianceCache, NoSeamBetweenTheTrianglesOfAQuad) {
  MeshBuilder builder;
  const MaterialId grey = builder.AddMaterial("grey", 0.5);
  builder.AddQuad({-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}, grey);
  builder.AddBox({2.0, 1.0, 0.0}, {1.0, 1.0, 2.0}, 0.3, grey);
  const World world(std::move(builder).Finish());
  const IrradianceCache cache(world, {0.4F});
  for (double s = -9.0; s < 9.0; s += 0.37) {  // along the diagonal, on both sides of it
    if ((Eigen::Vector2d(s, s) - Eigen::Vector2d(2.0, 1.0)).norm() < 1.2) continue;
    const float left = Under(world, cache, {s, s + 1e-4, 0.0}).sky;
    const float right = Under(world, cache, {s, s - 1e-4, 0.0}).sky;
    EXPECT_NEAR(left, right, 2e-3F * left) << s;
  }
}

// A wall that goes on through a roof: inside it is as dark up to the edge as far below it, and as
// bright outside. Nodes of the wall lie on both sides of the roof.
TEST(IrradianceCache, NoLightLeaksPastWhatPiercesATriangle) {
  MeshBuilder builder;
  const MaterialId grey = builder.AddMaterial("grey", 0.5);
  const double roof = 2.13;
  builder.AddQuad({-20, 0, 0}, {20, 0, 0}, {20, 0, 5}, {-20, 0, 5}, grey);                // wall
  builder.AddQuad({-20, -8, roof}, {20, -8, roof}, {20, 8, roof}, {-20, 8, roof}, grey);  // roof
  builder.AddQuad({-20, -8, 0}, {20, -8, 0}, {20, 8, 0}, {-20, 8, 0}, grey);              // floor
  builder.AddQuad({-20, -8, 0}, {20, -8, 0}, {20, -8, roof}, {-20, -8, roof}, grey);
  builder.AddQuad({-20, -8, 0}, {-20, 8, 0}, {-20, 8, roof}, {-20, -8, roof}, grey);
  builder.AddQuad({20, -8, 0}, {20, 8, 0}, {20, 8, roof}, {20, -8, roof}, grey);
  const World world(std::move(builder).Finish(),
                    {.sun_illuminance = 0.0, .sky_illuminance = 10000.0});
  const IrradianceCache cache(world, {0.3F});
  const auto at = [&](double x, double z) {
    const auto hit = world.Cast({x, -0.5, z}, Eigen::Vector3d::UnitY(), 1.0);
    return cache.At(hit.value().triangle, hit->barycentric, hit->normal).sky;
  };
  for (double x = -5.0; x < 5.0; x += 0.173) {
    for (const double below : {0.01, 0.05, 0.1, 0.3}) EXPECT_LT(at(x, roof - below), 5.0F) << x;
    for (const double above : {0.01, 0.05, 0.1, 0.3}) EXPECT_GT(at(x, roof + above), 3000.0F) << x;
  }
}

TEST(Sky, GivesItsIlluminanceOnLevelGround) {
  const Lighting light{.sun_illuminance = 0.0, .sky_illuminance = 5000.0};
  double sum = 0.0;
  constexpr int kSteps = 60;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < 4 * kSteps; ++j) {
      const double z2 = (i + 0.5) / kSteps, angle = 0.5 * std::numbers::pi * (j + 0.5) / kSteps;
      const double r = std::sqrt(1.0 - z2);
      sum += SkyLuminance(light, {r * std::cos(angle), r * std::sin(angle), std::sqrt(z2)});
    }
  }
  EXPECT_NEAR(std::numbers::pi * sum / (4.0 * kSteps * kSteps), 5000.0, 250.0);
}

}  // namespace
}  // namespace mlvi

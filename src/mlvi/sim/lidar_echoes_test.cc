// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_echoes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mlvi/sim/lidar_simulator.h"
#include "mlvi/sim/mesh_builder.h"

namespace mlvi {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
const Time kBegin = Time::FromNanoseconds(0);

PoseSpline Still() {
  return PoseSpline(kBegin - Duration::FromMilliseconds(500), Duration::FromMilliseconds(100),
                    std::vector<Pose3>(14));
}

// Rays from the origin to all sides within `spread` rad of +x, fired at once.
LidarPattern Fan(std::size_t rays, double spread, const LidarPhysics& physics) {
  LidarPattern pattern{.rings = 1, .firing_offsets_ns = {0}, .physics = physics};
  for (std::size_t i = 0; i < rays; ++i) {
    const double angle = spread * (2.0 * static_cast<double>(i) / static_cast<double>(rays) - 1.0);
    pattern.rays.push_back(
        {.direction = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0).cast<float>()});
  }
  return pattern;
}

std::vector<LidarPoint> Fire(const World& world, const LidarPattern& pattern) {
  const LidarSimulator lidar(pattern, Pose3(), RandomStream(1, "lidar"));
  return lidar.Sweep(world, Still(), kBegin, 0).points;
}

LidarPhysics Exact() {
  return {.range_noise = 0.0, .beam_noise = 0.0, .range_resolution = 1e-6, .dropout = 0.0};
}

// A vertical wall through `point`, `half` m to each side, whose normal is turned by `angle` from
// -x.
void AddWall(MeshBuilder& builder, const Eigen::Vector3d& point, double angle, double half,
             const Material& material) {
  const Eigen::Vector3d along(std::sin(angle), std::cos(angle), 0.0), up(0.0, 0.0, half);
  const Eigen::Vector3d a = point - half * along, b = point + half * along;
  builder.AddQuad(a - up, b - up, b + up, a + up, builder.AddMaterial(material));
}

// A sign that lies flush with the wall blooms: the rim of a beam on it outshines the middle.
TEST(LidarEchoes, RimsOnSignsOutshineTheMiddle) {
  MeshBuilder builder;
  AddWall(builder, {10.0, -4.98, 0.0}, 0.0, 5.0, {.name = "wall", .reflectivity = 0.2});
  AddWall(builder, {10.0, 5.02, 0.0}, 0.0, 5.0,
          {.name = "sign", .reflectivity = 0.8, .retroreflective = true});
  const World world(std::move(builder).Finish());
  LidarPhysics physics = Exact();
  const WorldSnapshot still = world.StaticSnapshot();
  const std::array pulse = {Pulse{{0, 0, 0}, {1, 0, 0}, &still, &still}};
  physics.beam_divergence = 0.002;  // its rim is 17 mm from the middle
  const auto beside = ReceivePulses(pulse, physics).front();
  physics.beam_divergence = 0.004;
  const auto touched = ReceivePulses(pulse, physics).front();
  ASSERT_TRUE(beside && touched);
  EXPECT_NEAR(beside->reflectivity, 0.2, 1e-3);
  EXPECT_GT(touched->reflectivity, 10.0);
}

class Pane : public ::testing::TestWithParam<double> {};

// The wall behind a slab returns as from its distance, weaker by the square of what the slab
// passes.
TEST_P(Pane, PassesThePulseTwice) {
  const double angle = GetParam(), mirror = 0.08, transmission = 0.75, c = std::cos(angle);
  MeshBuilder builder;
  AddWall(
      builder, {2.0, 0.0, 0.0}, angle, 1.0,
      {.name = "glass", .reflectivity = 0.0, .transmission = transmission, .lidar_mirror = mirror});
  AddWall(builder, {5.0, 0.0, 0.0}, 0.0, 20.0, {.name = "wall", .reflectivity = 0.5});
  const World world(std::move(builder).Finish());
  const double schlick = mirror + (1.0 - mirror) * std::pow(1.0 - c, 5);
  const double passed = transmission * (1.0 - schlick) / (1.0 - mirror);
  const double reflectivity = passed * passed * 0.5;
  LidarPhysics physics = Exact();
  // At the threshold: half of the returns are detected by the closed form.
  physics.reference_range = 5.0 * std::sqrt(0.8 / reflectivity);
  const std::size_t n = 20000;
  const auto points = Fire(world, Fan(n, 0.001, physics));
  std::size_t seen = 0;
  for (const LidarPoint& point : points) {
    if (point.position.isZero(0.0F)) continue;
    EXPECT_NEAR(point.position.x(), 5.0, 1e-4);
    EXPECT_NEAR(point.intensity, 255.0 * reflectivity, 0.02 * 255.0 * reflectivity);
    ++seen;
  }
  // Binomial: 5 sigma; and over the fan the power varies by up to 0.2 %.
  EXPECT_NEAR(static_cast<double>(seen) / n, 0.5, 5.0 * 0.5 / std::sqrt(n) + 0.002);
}
INSTANTIATE_TEST_SUITE_P(Angles, Pane, ::testing::Values(30 * kDegree, 50 * kDegree, 70 * kDegree));

// At grazing incidence a pane is a mirror: what stands before it appears behind it.
TEST(LidarEchoes, GhostsAppearBehindPanes) {
  MeshBuilder builder;
  const double angle = 80.0 * kDegree;
  AddWall(builder, {2.0, 0.0, 0.0}, angle, 1.0,
          {.name = "glass", .reflectivity = 0.0, .transmission = 0.75, .lidar_mirror = 0.08});
  // Mirrored, +x becomes a direction 160 deg off -x; a wall stands 3 m along it.
  const Eigen::Vector3d normal(-std::cos(angle), std::sin(angle), 0.0);
  const Eigen::Vector3d onward = Eigen::Vector3d::UnitX() - 2.0 * normal.x() * normal;
  AddWall(builder, Eigen::Vector3d(2.0, 0.0, 0.0) + 3.0 * onward, -20.0 * kDegree, 1.0,
          {.name = "wall", .reflectivity = 0.8});
  const World world(std::move(builder).Finish());
  LidarPhysics physics = Exact();
  physics.reference_range = 100.0;
  const auto points = Fire(world, Fan(2, 1e-6, physics));
  EXPECT_NEAR(points[0].position.x(), 5.0, 1e-3);
  EXPECT_NEAR(points[0].position.y(), 0.0, 1e-3);
  const WorldSnapshot still = world.StaticSnapshot();
  const auto truth =
      ReceivePulses(std::array{Pulse{{0, 0, 0}, {1, 0, 0}, &still, &still}}, physics).front();
  ASSERT_TRUE(truth.has_value());
  EXPECT_EQ(truth->path, EchoPath::kMirrored);
}

// What shines in images does not mirror pulses: a polished floor returns like a dull one.
TEST(LidarEchoes, GlossIsNoMirror) {
  const auto sweep = [](double gloss) {
    MeshBuilder builder;
    AddWall(builder, {2.0, 0.0, 0.0}, 80.0 * kDegree, 3.0,
            {.name = "floor", .reflectivity = 0.3, .mirror = gloss});
    AddWall(builder, {0.0, 3.0, 0.0}, -90.0 * kDegree, 20.0, {.name = "wall"});
    const World world(std::move(builder).Finish());
    return Fire(world, Fan(500, 0.2, Exact()));
  };
  const auto dull = sweep(0.0), glossy = sweep(0.3);
  ASSERT_NEAR(dull[250].position.x(), 2.0, 0.01);
  for (std::size_t i = 0; i < dull.size(); ++i) EXPECT_EQ(glossy[i].position, dull[i].position);
}

TEST(LidarEchoes, AnIdealSensorEndsAtTheFirstSurface) {
  MeshBuilder builder;
  AddWall(builder, {2.0, 0.0, 0.0}, 0.4, 1.0,
          {.name = "glass", .reflectivity = 0.01, .transmission = 0.9, .lidar_mirror = 0.08});
  AddWall(builder, {5.0, 0.0, 0.0}, 0.0, 20.0, {.name = "wall"});
  const World world(std::move(builder).Finish());
  LidarPhysics physics = IdealPhysics(Exact());
  const auto points = Fire(world, Fan(2, 1e-6, physics));
  EXPECT_NEAR(points[0].position.x(), 2.0, 1e-4);
  physics.first_surface = false;
  EXPECT_NEAR(Fire(world, Fan(2, 1e-6, physics))[0].position.x(), 5.0, 1e-4);
}

TEST(LidarEchoes, PanesAreSeenFaceOnOnly) {
  const Material glass{
      .name = "glass", .reflectivity = 0.01, .transmission = 0.8, .lidar_mirror = 0.08};
  EXPECT_GT(EchoOf(glass, 1.0, 5.0, 1.0).reflectivity, 100.0);
  EXPECT_NEAR(EchoOf(glass, std::cos(5.0 * kDegree), 5.0, 1.0).reflectivity, 0.01, 0.001);
  EXPECT_EQ(EchoOf(glass, 0.5, 5.0, 0.5).reflectivity, 0.25 * 0.5 * 0.01);
}

TEST(LidarEchoes, RetroReflectorsAreSeenFarAndBright) {
  Material sign{.name = "sign", .reflectivity = 0.8, .retroreflective = true};
  MeshBuilder builder;
  AddWall(builder, {90.0, 0.0, 0.0}, 0.3, 5.0, sign);
  const World world(std::move(builder).Finish());
  LidarPhysics physics = Exact();
  physics.reference_range = 10.0;  // a white wall would be lost at 12 m
  for (const LidarPoint& point : Fire(world, Fan(100, 0.02, physics))) {
    EXPECT_NEAR(point.position.x(), 90.0, 1.0);
    EXPECT_EQ(point.intensity, 255.0F);
  }
}

// A panel before a wall: with a beam of some width there are ranges between both where they are
// nearer than a pulse, within the beam of the panel's rim only, and none where they are farther.
TEST(LidarEchoes, MixedPixelsLieAtDepthEdgesOnly) {
  for (const double gap : {0.3, 2.0}) {
    MeshBuilder builder;
    builder.AddQuad({5, -30, -5}, {5, 0, -5}, {5, 0, 5}, {5, -30, 5},
                    builder.AddMaterial({.name = "panel", .reflectivity = 0.5}));
    AddWall(builder, {5.0 + gap, 0.0, 0.0}, 0.0, 30.0, {.name = "wall", .reflectivity = 0.5});
    const World world(std::move(builder).Finish());
    LidarPhysics physics = Exact();
    physics.beam_divergence = 0.006;
    const double reach = 2.0 * 0.006 / 2.3548;  // rad, of the outermost rays of a beam
    int mixed = 0;
    for (const LidarPoint& point : Fire(world, Fan(4000, 0.1, physics))) {
      ASSERT_FALSE(point.position.isZero(0.0F));
      const double x = point.position.x(), angle = std::atan2(point.position.y(), x);
      if (x > 5.01 && x < 5.0 + gap - 0.01) {
        ++mixed;
        EXPECT_LT(std::abs(angle), reach + 1e-4);
      } else if (std::abs(angle) > 1e-4) {
        EXPECT_EQ(x < 5.01, angle < 0.0) << angle;
      }
    }
    if (gap > physics.pulse_length) {
      EXPECT_EQ(mixed, 0);
    } else {
      // All beams within the reach of the edge, of 4000 over 0.2 rad.
      EXPECT_NEAR(mixed, 2.0 * reach / 0.2 * 4000.0, 3.0);
    }
  }
}

TEST(LidarEchoes, RangesAreBiasedByIncidenceAndReflectivity) {
  LidarPhysics physics = Exact();
  physics.beam_divergence = 0.006;
  physics.incidence_bias = 0.3;
  physics.walk_error = 0.004;
  for (const double angle : {0.0, 45.0 * kDegree, 75.0 * kDegree}) {
    MeshBuilder builder;
    AddWall(builder, {10.0, 0.0, 0.0}, angle, 5.0, {.name = "wall", .reflectivity = 0.2});
    const World world(std::move(builder).Finish());
    const auto points = Fire(world, Fan(2, 1e-6, physics));
    const double expected = 0.004 * std::log10(0.8 / (0.2 * std::cos(angle))) -
                            0.3 * 0.5 * 0.006 * 10.0 * std::tan(angle);
    EXPECT_NEAR(points[0].position.x() - 10.0, expected, 1e-4) << angle;
  }
  EXPECT_EQ(RangeBias(Exact(), 10.0, 0.3, 0.1), 0.0);
}

}  // namespace
}  // namespace mlvi

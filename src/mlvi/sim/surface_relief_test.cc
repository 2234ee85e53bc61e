// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/surface_relief.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "mlvi/base/random.h"
#include "mlvi/sim/averaged_relief.h"

namespace mlvi {
namespace {

Eigen::Vector3d RandomPoint(RandomStream& random, double size) {
  const double x = random.Uniform(-size, size), y = random.Uniform(-size, size);
  return {x, y, random.Uniform(-size, size)};
}

// Heights have the promised rms and mean zero, over space and over walls along the axes; and never
// exceed the bound.
TEST(SurfaceRelief, IsAsHighAsItsMaterialSays) {
  const SurfaceRelief surface;
  const Relief relief{.fine = 0.003, .fine_size = 0.1, .coarse = 0.004, .coarse_size = 0.5};
  const double rms = std::hypot(relief.fine, relief.coarse);
  RandomStream random(3);
  for (const int axis : {-1, 0, 1, 2}) {
    double sum = 0.0, squares = 0.0, largest = 0.0;
    constexpr int kPoints = 100000;
    for (int i = 0; i < kPoints; ++i) {
      Eigen::Vector3d point = RandomPoint(random, 8.0);
      if (axis >= 0) point[axis] = 2.0;
      const double height = surface.HeightAt(relief, point);
      sum += height, squares += height * height, largest = std::max(largest, std::abs(height));
    }
    // A wall of 16 x 16 m has some 1000 coarse bumps, so the mean errs by 3 % of the rms and the
    // rms by 2 %.
    EXPECT_NEAR(sum / kPoints, 0.0, 0.1 * rms) << axis;
    EXPECT_NEAR(std::sqrt(squares / kPoints), rms, 0.08 * rms) << axis;
    EXPECT_LT(largest, relief.bound());
    EXPECT_GT(largest, 1.5 * rms);
  }
}

// Neighbours are alike and places farther apart than a bump are not: the correlation of value noise
// falls to zero within two lattice steps.
TEST(SurfaceRelief, IsCoherentInSpace) {
  const SurfaceRelief surface;
  const Relief relief{.fine = 0.01, .fine_size = 0.1};
  RandomStream random(4);
  const auto correlation = [&](double distance) {
    double product = 0.0;
    constexpr int kPairs = 40000;
    for (int i = 0; i < kPairs; ++i) {
      const Eigen::Vector3d point = RandomPoint(random, 20.0);
      const Eigen::Vector3d across = distance * RandomPoint(random, 1.0).normalized();
      product += surface.HeightAt(relief, point) * surface.HeightAt(relief, point + across);
    }
    return product / kPairs / (relief.fine * relief.fine);
  };
  EXPECT_GT(correlation(0.01), 0.95);
  EXPECT_GT(correlation(0.05), 0.3);
  // Exactly zero beyond sqrt(3) * 2 lattice steps; the mean of 40000 products errs by 0.005.
  EXPECT_NEAR(correlation(0.36), 0.0, 0.025);
}

// A ray ends on the surface that HeightAt describes, from whatever side and distance it comes: the
// law that makes relief a property of the wall and not of the measurement.
TEST(SurfaceRelief, EndsRaysOnOneSurfaceSeenFromAnywhere) {
  const SurfaceRelief surface;
  const Relief plaster{.fine = 0.001, .fine_size = 0.15, .coarse = 0.0025, .coarse_size = 0.9},
      grass{.fine = 0.012, .fine_size = 0.1, .coarse = 0.02, .coarse_size = 0.5};
  RandomStream random(5);
  for (const Relief& relief : {plaster, grass}) {
    int off = 0;
    constexpr int kRays = 20000;
    for (int i = 0; i < kRays; ++i) {
      const Eigen::Vector3d normal = RandomPoint(random, 1.0).normalized(),
                            on_plane = RandomPoint(random, 20.0);
      const Eigen::Vector3d direction = RandomPoint(random, 1.0).normalized();
      const double cosine = -normal.dot(direction);
      if (cosine < 0.2) continue;
      const double s = surface.ShortensBy(relief, on_plane, direction, cosine);
      EXPECT_LE(std::abs(s), relief.bound() / cosine);
      const Eigen::Vector3d end = on_plane - s * direction;
      off += std::abs(normal.dot(end - on_plane) - surface.HeightAt(relief, end)) > 3e-4;
    }
    EXPECT_LT(off, kRays / 200);
  }
}

// Of all places where a ray crosses the surface it ends on the first, at any angle.
TEST(SurfaceRelief, EndsRaysWhereTheyFirstMeetIt) {
  const SurfaceRelief surface;
  const Relief grass{.fine = 0.012, .fine_size = 0.1, .coarse = 0.02, .coarse_size = 0.5},
      rock{.fine = 0.012, .fine_size = 0.12, .coarse = 0.02, .coarse_size = 0.4},
      asphalt{.fine = 0.002, .fine_size = 0.1, .coarse = 0.004, .coarse_size = 0.7};
  RandomStream random(6);
  for (const Relief& relief : {grass, rock, asphalt}) {
    for (const double cosine : {0.2, 0.3, 0.5, 0.8}) {
      int early = 0, off = 0;
      constexpr int kRays = 2000;
      for (int i = 0; i < kRays; ++i) {
        const Eigen::Vector3d normal = RandomPoint(random, 1.0).normalized(),
                              on_plane = RandomPoint(random, 20.0);
        const Eigen::Vector3d direction =
            -cosine * normal + std::sqrt(1.0 - cosine * cosine) * normal.unitOrthogonal();
        const auto above = [&](double s) {
          return s * cosine - surface.HeightAt(relief, on_plane - s * direction);
        };
        const double s = surface.ShortensBy(relief, on_plane, direction, cosine);
        off += std::abs(above(s)) > 3e-4;
        bool crossed = false;
        for (double t = relief.bound() / cosine; t > s + 0.005; t -= 0.002)
          crossed = crossed || above(t) < 0.0;
        early += crossed;
      }
      // Tips of bumps narrower than a quarter of a bump, 1 mm over the ray, may be passed.
      EXPECT_LE(early, kRays / 400) << relief.fine << " " << cosine;
      EXPECT_LE(off, kRays / 1000) << relief.fine << " " << cosine;
    }
  }
}

// The relief that a beam sees is as rough as means of heights over what it lights are.
TEST(SurfaceRelief, IsAveragedOverTheBeam) {
  const SurfaceRelief surface;
  const Relief relief{.fine = 0.01, .fine_size = 0.1};
  RandomStream random(7);
  for (const auto& [deviation, cosine] :
       {std::pair{0.02, 1.0}, std::pair{0.02, 0.4}, std::pair{0.05, 1.0}, std::pair{0.05, 0.4}}) {
    double squares = 0.0;
    constexpr int kPlaces = 1500, kSamples = 60;
    for (int i = 0; i < kPlaces; ++i) {
      const Eigen::Vector3d place = RandomPoint(random, 30.0);
      const Eigen::Vector3d u = RandomPoint(random, 1.0).normalized(), v = u.unitOrthogonal();
      // Two halves of the samples: their product has no share of the samples' own noise.
      std::array<double, 2> mean{};
      for (int k = 0; k < kSamples; ++k) {
        const double a = deviation * random.Normal(), b = deviation / cosine * random.Normal();
        mean[static_cast<std::size_t>(k % 2)] +=
            2.0 / kSamples * surface.HeightAt(relief, place + a * u + b * v);
      }
      squares += mean[0] * mean[1] / kPlaces;
    }
    // Squares of normal numbers have the deviation sqrt(2): 4 % of their mean, the model 5 %.
    const double promised = AveragedRelief(relief, deviation, cosine).fine;
    EXPECT_NEAR(squares / (promised * promised), 1.0, 0.15) << deviation << " " << cosine;
  }
  EXPECT_EQ(AveragedRelief(relief, 0.0, 0.5).fine, relief.fine);
}

// Nowhere along the axes of buildings does it come again.
TEST(SurfaceRelief, DoesNotRepeatAlongWalls) {
  const SurfaceRelief surface;
  const Relief relief{.fine = 0.01, .fine_size = 0.1};
  RandomStream random(8);
  for (int axis = 0; axis < 3; ++axis) {
    for (int bumps = 4; bumps < 500; ++bumps) {
      double product = 0.0;
      constexpr int kPlaces = 40;
      for (int i = 0; i < kPlaces; ++i) {
        const Eigen::Vector3d place = RandomPoint(random, 20.0);
        product += surface.HeightAt(relief, place) *
                   surface.HeightAt(relief, place + 0.1 * bumps * Eigen::Vector3d::Unit(axis));
      }
      // 1 where it repeats; else as 40 products of normal numbers.
      EXPECT_LT(product / kPlaces / (relief.fine * relief.fine), 0.8) << axis << " " << bumps;
    }
  }
}

TEST(SurfaceRelief, IsNoneWhereAMaterialHasNone) {
  const SurfaceRelief surface;
  EXPECT_EQ(surface.ShortensBy({}, {1.0, 2.0, 3.0}, Eigen::Vector3d::UnitX(), 0.7), 0.0);
  EXPECT_EQ(surface.HeightAt({}, {1.0, 2.0, 3.0}), 0.0);
  EXPECT_TRUE(Relief{}.plane());
}

}  // namespace
}  // namespace mlvi

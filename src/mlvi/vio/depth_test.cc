// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/geometry/equal_area_sphere.h"
#include "mlvi/panorama/testing.h"
#include "mlvi/vio/depth_accumulator.h"
#include "mlvi/vio/depth_association.h"
#include "mlvi/vio/depth_picture.h"
#include "mlvi/vio/depth_testing.h"

namespace mlvi {
namespace {

using test::IsOnOneSurface;
using test::RangeInRoom;
using test::ScanRoom;

class DepthInARoom : public ::testing::Test {
 protected:
  DepthConfig config_ = [] {
    DepthConfig config;
    config.roughness = config.beam_noise = config.incidence_noise = 0.0;
    config.range_noise = 0.02;
    return config;
  }();
  Pose3 T_world_pano_{ExpSo3({0.1, -0.2, 2.0}), {0.1, 0.05, 0.0}};
};

// Without noise a plane through three of its points is the plane: depth is exact along the ray from
// C_i, however far the camera is from S, and in every direction: nothing happens at the azimuth of
// +-pi.
TEST_F(DepthInARoom, IsExactOnPlanesForEveryCamera) {
  const SphericalDepthMap map(ScanRoom(Pose3(), 0.0, RandomStream(1)), T_world_pano_, config_);
  RandomStream random(2);
  int asked = 0, found = 0, seam = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Ray pano{.origin = random.Uniform(0.0, 0.3) * test::RandomDirection(random),
                   .direction = test::RandomDirection(random)};
    const Ray world{T_world_pano_ * pano.origin, T_world_pano_.rotation() * pano.direction};
    if (std::abs(world.direction.z()) > 0.6 || !IsOnOneSurface(world)) continue;
    ++asked;
    const FeatureDepth depth = AssociateDepth(map, pano, config_);
    if (depth.status != DepthStatus::kFound) continue;
    ++found;
    seam += std::abs(std::atan2(pano.direction.y(), pano.direction.x())) > std::numbers::pi - 0.05
                ? 1
                : 0;
    // Points are floats.
    EXPECT_NEAR(depth.depth, RangeInRoom(world.origin, world.direction), 2e-4);
  }
  EXPECT_GT(asked, 1500);
  EXPECT_GT(found, 0.95 * asked);
  EXPECT_GT(seam, 10);
}

TEST_F(DepthInARoom, VarianceIsThatOfTheErrors) {
  config_.voxel_size = 0.01;
  RandomStream random(3);
  double normalised = 0.0;
  int count = 0;
  const SphericalDepthMap map(ScanRoom(Pose3(), config_.range_noise, RandomStream(4)),
                              T_world_pano_, config_);
  for (int trial = 0; trial < 6000; ++trial) {
    const Ray pano{.origin = 0.1 * test::RandomDirection(random),
                   .direction = test::RandomDirection(random),
                   .sigma = 1e-9};
    const Ray world{T_world_pano_ * pano.origin, T_world_pano_.rotation() * pano.direction};
    if (std::abs(world.direction.z()) > 0.6 || !IsOnOneSurface(world)) continue;
    const FeatureDepth depth = AssociateDepth(map, pano, config_);
    if (depth.status != DepthStatus::kFound) continue;
    const double error = depth.depth - RangeInRoom(world.origin, world.direction);
    normalised += error * error / depth.variance;
    ++count;
  }
  ASSERT_GT(count, 2000);
  // Neighbouring rays share points, so the mean of squares is known to a few per cent only; of the
  // points of a cell the nearest is kept, which shifts depths by a part of the noise where cells
  // hold two.
  EXPECT_NEAR(normalised / count, 1.0, 0.25);
}

// At the edges of the pillar depth jumps from 2 to 4 m: what is found there is the truth or, within
// a cell of an edge, that of the other side; never something between, nor the wall through the
// pillar.
TEST_F(DepthInARoom, EdgesGiveNoDepthInBetween) {
  const SphericalDepthMap map(ScanRoom(Pose3(), 0.0, RandomStream(5)), Pose3(), config_);
  int spread = 0;
  for (int i = 0; i < 400; ++i) {
    const double azimuth = -0.3 + 0.6 * i / 400.0;
    const Ray ray{.origin = {0.0, 0.1, 0.0},
                  .direction = {std::cos(azimuth), std::sin(azimuth), 0.02}};
    const Ray unit{ray.origin, ray.direction.normalized()};
    const FeatureDepth depth = AssociateDepth(map, unit, config_);
    spread += depth.status == DepthStatus::kSpread || depth.status == DepthStatus::kForeground;
    if (depth.status != DepthStatus::kFound) continue;
    double nearest_truth = std::numeric_limits<double>::infinity();
    for (const double off : {-1.0, 0.0, 1.0}) {
      const double beside = azimuth + off * config_.cell_angle;
      const Eigen::Vector3d direction(std::cos(beside), std::sin(beside), 0.02);
      const double truth = RangeInRoom(unit.origin, direction.normalized());
      nearest_truth = std::min(nearest_truth, std::abs(depth.depth - truth));
    }
    EXPECT_LT(nearest_truth, 0.02) << azimuth << " " << depth.depth;
  }
  EXPECT_GT(spread, 5);
}

// A plate before a wall, seen whole from S: from a camera beside S a ray that meets the plate has
// the wall in its direction at infinity, in full sight of S. It is the plate's depth or none.
TEST_F(DepthInARoom, LooksThroughNothing) {
  constexpr double kWall = 6.0, kHalf = 0.15;
  for (const double plate : {0.7, 1.0, 2.0}) {
    const auto range = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& u) {
      const double depth = (plate - from.x()) / u.x();
      return std::abs(from.y() + depth * u.y()) < kHalf ? depth : (kWall - from.x()) / u.x();
    };
    const auto direction = [](double azimuth, double elevation) {
      return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    };
    PointCloud cloud;
    for (double azimuth = -0.8; azimuth < 0.8; azimuth += 0.003) {
      for (double elevation = -0.3; elevation < 0.3; elevation += 0.003) {
        const Eigen::Vector3d beam = direction(azimuth, elevation);
        cloud.push_back((range(Eigen::Vector3d::Zero(), beam) * beam).cast<float>());
      }
    }
    const SphericalDepthMap map(cloud, Pose3(), config_);
    for (const double offset : {0.07, 0.16, 0.25}) {
      const Eigen::Vector3d camera(0.0, offset, 0.0);
      int on_plate = 0, plate_found = 0, on_wall = 0, wall_found = 0;
      for (double azimuth = -0.6; azimuth < 0.6; azimuth += 0.002) {
        for (double elevation = -0.1; elevation < 0.1; elevation += 0.02) {
          const Ray ray{.origin = camera, .direction = direction(azimuth, elevation)};
          const double truth = range(camera, ray.direction);
          const bool before = truth < 0.5 * kWall;
          (before ? on_plate : on_wall) += 1;
          const FeatureDepth depth = AssociateDepth(map, ray, config_);
          if (depth.status != DepthStatus::kFound) continue;
          (before ? plate_found : wall_found) += 1;
          EXPECT_NEAR(depth.depth, truth, 1e-3 * truth)
              << "plate at " << plate << " m, camera at " << offset << " m, " << azimuth;
        }
      }
      EXPECT_GT(plate_found, 0.5 * on_plate) << plate << " " << offset;
      EXPECT_GT(wall_found, 0.5 * on_wall) << plate << " " << offset;
    }
  }
}

TEST_F(DepthInARoom, NoPointsNoDepth) {
  const SphericalDepthMap map(ScanRoom(Pose3(), 0.0, RandomStream(6)), Pose3(), config_);
  const Ray up{.direction = Eigen::Vector3d::UnitZ()};  // above all rings
  EXPECT_EQ(AssociateDepth(map, up, config_).status, DepthStatus::kNoPoints);
  const SphericalDepthMap empty(PointCloud{}, Pose3(), config_);
  EXPECT_EQ(AssociateDepth(empty, up, config_).status, DepthStatus::kNoPoints);
}

TEST(SphericalDepthMap, NearestAgreesWithTheDefinition) {
  RandomStream random(7);
  PointCloud cloud;
  for (int i = 0; i < 20000; ++i) {
    cloud.push_back((random.Uniform(0.5, 50.0) * test::RandomDirection(random)).cast<float>());
  }
  const SphericalDepthMap map(cloud, test::RandomPose(random, 0.2, 3.0), {});
  const auto angle = [&](std::size_t i, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d u = map.points()[i].normalized();
    return std::atan2(u.cross(direction).norm(), u.dot(direction));
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector3d direction = test::RandomDirection(random);
    std::vector<std::pair<double, int>> all;
    for (std::size_t i = 0; i < map.points().size(); ++i) {
      if (angle(i, direction) <= 0.05) all.emplace_back(angle(i, direction), static_cast<int>(i));
    }
    std::sort(all.begin(), all.end());
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [off, i] : all) {
      nearest = std::min(nearest, map.points()[static_cast<std::size_t>(i)].norm());
    }
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(map.NearestRange(direction, 0.05).value_or(infinity), nearest);
    const auto near = map.Nearest(direction, 10, 0.05);
    ASSERT_EQ(near.count, std::min(10, static_cast<int>(all.size())));
    for (int i = 0; i < near.count; ++i) {
      EXPECT_EQ(near.index[i], all[static_cast<std::size_t>(i)].second);
      EXPECT_NEAR(near.angle[i], all[static_cast<std::size_t>(i)].first, 1e-9);
    }
  }
}

// What lies behind is hidden, even when it came first; the same bits at any number of threads.
TEST(SphericalDepthMap, KeepsTheNearestSurfacePerCell) {
  const PointCloud room = ScanRoom(Pose3(), 0.0, RandomStream(8));
  PointCloud both;
  for (const Eigen::Vector3f& p : room) both.push_back(2.0F * p);  // the same direction, to the bit
  both.insert(both.end(), room.begin(), room.end());
  const SphericalDepthMap expected(room, Pose3(), {}), map(both, Pose3(), {});
  EXPECT_EQ(map.points(), expected.points());
  const ThreadLimit limit(1);
  EXPECT_EQ(SphericalDepthMap(both, Pose3(), {}).points(), map.points());
}

TEST(SphericalDepthMap, CellsAgreeWithTheDefinition) {
  DepthConfig config;
  config.cell_angle = 0.03;
  const PointCloud room = ScanRoom(Pose3(), 0.05, RandomStream(12));
  const SphericalDepthMap map(room, Pose3(), config);
  const EqualAreaSphere cells = EqualAreaSphere::WithCellAngle(config.cell_angle);
  std::map<int, std::vector<Eigen::Vector3d>> in_cell;
  for (const Eigen::Vector3f& p : room) {
    in_cell[cells.CellOf(p.cast<double>())].push_back(p.cast<double>());
  }
  ASSERT_EQ(map.points().size(), in_cell.size());
  std::size_t i = 0;
  for (const auto& [cell, points] : in_cell) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& p : points) nearest = std::min(nearest, p.norm());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const auto& p : points) {
      if (p.norm() > nearest + config.layer) continue;
      sum += p;
      ++count;
    }
    EXPECT_LT((map.points()[i++] - sum / count).norm(), 1e-6) << "cell " << cell;
  }
}

// The nearest point of a cell is the one with the most negative error; a layer has none.
TEST(SphericalDepthMap, LayersOfManyPointsAreNotTooNear) {
  constexpr double kRange = 10.0, kNoise = 0.02;
  RandomStream random(13);
  PointCloud wall;
  for (int i = 0; i < 200000; ++i) {
    const Eigen::Vector3d beam =
        Eigen::Vector3d(1.0, random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2)).normalized();
    wall.push_back(((kRange / beam.x() + kNoise * random.Normal()) * beam).cast<float>());
  }
  const SphericalDepthMap map(wall, Pose3(), {});
  double sum = 0.0;
  for (const Eigen::Vector3d& p : map.points()) sum += p.x() - kRange;
  // 30 points per cell: a mean of them scatters by 4 mm, and there are 4000 cells.
  EXPECT_LT(std::abs(sum) / static_cast<double>(map.points().size()), 0.1 * kNoise);
}

TEST(DepthAccumulator, KeepsTheNewestPointPerVoxelOfTheLastSeconds) {
  DepthConfig config;
  config.span = 2.0;
  config.voxel_size = 0.5;
  DepthAccumulator accumulator(config);
  const auto at = [](double t) { return Time::FromSeconds(100.0 + t); };
  accumulator.Add(at(0.0), PointCloud{{0.1F, 0.1F, 0.1F}, {5.1F, 0.1F, 0.1F}});
  accumulator.Add(at(1.0), PointCloud{{0.2F, 0.1F, 0.1F}, {-5.1F, 0.1F, 0.1F}});
  EXPECT_EQ(accumulator.points(),
            (PointCloud{{0.2F, 0.1F, 0.1F}, {5.1F, 0.1F, 0.1F}, {-5.1F, 0.1F, 0.1F}}));
  accumulator.Add(at(2.5),
                  PointCloud{{-5.2F, 0.1F, 0.1F}});  // what was seen at 0 only is forgotten
  EXPECT_EQ(accumulator.points(), (PointCloud{{0.2F, 0.1F, 0.1F}, {-5.2F, 0.1F, 0.1F}}));
  accumulator.Add(at(4.0), PointCloud{{0.3F, 0.1F, 0.1F}});
  EXPECT_EQ(accumulator.points(), (PointCloud{{-5.2F, 0.1F, 0.1F}, {0.3F, 0.1F, 0.1F}}));
  EXPECT_THROW(accumulator.Add(at(3.0), PointCloud{}), ContractViolation);
}

// Standing still, memory and cost stay where they are.
TEST(DepthAccumulator, IsBounded) {
  DepthAccumulator accumulator({});
  std::vector<std::size_t> sizes;
  for (int i = 0; i < 20; ++i) {
    accumulator.Add(Time::FromSeconds(0.5 * i),
                    ScanRoom(Pose3(ExpSo3({0.0, 0.0, 0.001 * i}), {}), 0.0, RandomStream(9)));
    sizes.push_back(accumulator.points().size());
  }
  EXPECT_LT(sizes.back(), 1.2 * static_cast<double>(sizes.front()));
}

TEST(DepthPicture, DrawsEveryPointOnceInTheCameraThatHoldsItBest) {
  const PanoramaModel model =
      test::MakePanorama(test::RingRig(4, 0.1, test::MakeWideCamera(2.6, 300)));
  RandomStream random(10);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d point = random.Uniform(1.0, 10.0) * test::RandomDirection(random);
    const auto views = model.ViewsOfPoint(point);
    const Eigen::Vector3d behind =
        1.3 * (point - model.T_pano_camera(0).translation()) + model.T_pano_camera(0).translation();
    const auto pictures = DrawDepthPictures(model, std::vector<Eigen::Vector3d>{point});
    int drawn = 0;
    for (const DepthPicture& picture : pictures) {
      drawn += static_cast<int>(std::count_if(picture.depths.begin(), picture.depths.end(),
                                              [](float depth) { return depth > 0.0F; }));
    }
    ASSERT_EQ(drawn, views.empty() ? 0 : 1);
    if (views.empty()) continue;
    const CameraView& best = views[0];
    for (const CameraView& view : views) EXPECT_LE(best.off_axis, view.off_axis);
    EXPECT_NEAR(pictures[static_cast<std::size_t>(best.camera)].At(
                    static_cast<int>(std::lround(best.pixel.x())),
                    static_cast<int>(std::lround(best.pixel.y()))),
                (point - model.T_pano_camera(best.camera).translation()).norm(), 1e-5);
    if (best.camera != 0) continue;
    // Of two points in one pixel the nearer one is drawn.
    const auto hidden =
        DrawDepthPictures(model, std::vector<Eigen::Vector3d>{behind, point, behind});
    EXPECT_EQ(hidden[0].depths, pictures[0].depths);
  }
}

}  // namespace
}  // namespace mlvi

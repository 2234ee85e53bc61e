// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/spatial/voxel_map.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/spatial/voxel_filter.h"

namespace mlvi {
namespace {

std::vector<Eigen::Vector3f> RandomPoints(int count, double extent, std::uint64_t seed) {
  RandomStream random(seed, "points");
  std::vector<Eigen::Vector3f> points(count);
  for (Eigen::Vector3f& point : points) {
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<float>(random.Uniform(-extent, extent));
  }
  return points;
}

// Distances of the k nearest within max_distance, by looking at every point.
std::vector<float> BruteForce(const std::vector<Eigen::Vector3f>& points,
                              const Eigen::Vector3f& query, int k, float max_distance) {
  std::vector<float> distances;
  for (const Eigen::Vector3f& point : points) {
    const float d = (point - query).norm();
    if (d <= max_distance) distances.push_back(d);
  }
  std::sort(distances.begin(), distances.end());
  distances.resize(std::min<std::size_t>(distances.size(), k));
  return distances;
}

void ExpectSameNeighbors(const VoxelMap& map, const std::vector<Eigen::Vector3f>& points,
                         std::uint64_t seed) {
  int found = 0;
  for (const Eigen::Vector3f& query : RandomPoints(300, 6.0, seed)) {
    for (const int k : {1, 5, 16}) {
      for (const float max_distance : {0.3F, 1.0F, 2.6F}) {
        const std::vector<float> expected = BruteForce(points, query, k, max_distance);
        Neighbors neighbors;
        map.KNearest(query, k, max_distance, neighbors);
        ASSERT_EQ(neighbors.count, static_cast<int>(expected.size()));
        for (int i = 0; i < neighbors.count; ++i) {
          EXPECT_NEAR(std::sqrt(neighbors.squared_distances[i]), expected[i], 1e-5);
          EXPECT_NEAR((neighbors.points[i] - query).norm(), expected[i], 1e-5);
        }
        found += neighbors.count;
      }
    }
  }
  EXPECT_GT(found, 1000);
}

TEST(VoxelMap, FindsTheNeighborsOfABruteForceSearch) {
  const std::vector<Eigen::Vector3f> points = RandomPoints(4000, 5.0, 1);
  VoxelMap map({.voxel_size = 0.5, .max_points_per_voxel = 100, .min_spacing = 0.0});
  EXPECT_EQ(map.Insert(points), points.size());
  ExpectSameNeighbors(map, points, 2);
}

TEST(VoxelMap, ErasesWhatIsFarAndFindsTheRest) {
  const std::vector<Eigen::Vector3f> points = RandomPoints(4000, 5.0, 3);
  VoxelMap map({.voxel_size = 0.5, .max_points_per_voxel = 100, .min_spacing = 0.0});
  map.Insert(points);
  const Eigen::Vector3f center(1.0F, -2.0F, 0.5F);
  EXPECT_GT(map.EraseBeyond(center, 3.0), 0U);
  std::vector<Eigen::Vector3f> rest = map.Points();
  ASSERT_EQ(rest.size(), map.size());
  for (const Eigen::Vector3f& point : points) {
    const bool kept = std::find(rest.begin(), rest.end(), point) != rest.end();
    const float distance = (point - center).norm();
    EXPECT_TRUE(kept || distance > 3.0F);
    EXPECT_TRUE(!kept || distance <= 3.0F + 0.5F * std::sqrt(3.0F));
  }
  ExpectSameNeighbors(map, rest, 4);
  map.Insert(RandomPoints(1000, 5.0, 5));  // freed cells are used again
  ExpectSameNeighbors(map, map.Points(), 6);
}

TEST(VoxelMap, MemoryStaysBoundedInASlidingWindow) {
  VoxelMap map({.voxel_size = 0.5, .max_points_per_voxel = 4, .min_spacing = 0.0});
  std::size_t memory = 0;
  for (int step = 0; step < 60; ++step) {
    std::vector<Eigen::Vector3f> points = RandomPoints(3000, 4.0, 100 + step);
    const Eigen::Vector3f center(static_cast<float>(step), 0.0F, 0.0F);
    for (Eigen::Vector3f& point : points) point += center;
    map.Insert(points);
    map.EraseBeyond(center, 6.0);
    if (step == 20) memory = map.memory_bytes();
  }
  ASSERT_GT(memory, 0U);
  EXPECT_LE(map.memory_bytes(), memory * 5 / 4);
}

TEST(VoxelMap, KeepsSpacingAndCapacity) {
  VoxelMap map({.voxel_size = 1.0, .max_points_per_voxel = 5, .min_spacing = 0.2});
  map.Insert(RandomPoints(20000, 2.0, 7));
  EXPECT_LE(map.size(), 5 * map.voxels());
  EXPECT_GT(map.size(), 3 * map.voxels());
  const std::vector<Eigen::Vector3f> points = map.Points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool same_cell = points[i].array().floor().isApprox(points[j].array().floor());
      EXPECT_TRUE(!same_cell || (points[i] - points[j]).norm() >= 0.2F);
    }
  }
}

TEST(VoxelThin, KeepsOneMeasuredPointPerCell) {
  const std::vector<Eigen::Vector3f> points = RandomPoints(20000, 3.0, 9);
  const std::vector<Eigen::Vector3f> thinned = VoxelThinned(points, 0.5);
  EXPECT_EQ(thinned.size(),
            12U * 12U * 12U);  // 20000 points leave none of the 1728 cells empty but with p = 1e-2
  for (const Eigen::Vector3f& point : thinned) {
    EXPECT_NE(std::find(points.begin(), points.end(), point), points.end());
  }
  EXPECT_THROW(VoxelThin(points, 0.0), ContractViolation);
}

}  // namespace
}  // namespace mlvi

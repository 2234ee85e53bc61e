// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/curvature.h"

#include <gtest/gtest.h>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);

// Distance to the nearest upright edge of the world: the corners of the room and of each box, seen
// from above.
double DistanceToUprightEdge(const test::BoxWorld& world, const Eigen::Vector3d& point) {
  double best = std::numeric_limits<double>::infinity();
  const auto try_box = [&](const test::Box& box) {
    for (const double x : {box.low.x(), box.high.x()}) {
      for (const double y : {box.low.y(), box.high.y()}) {
        best = std::min(best, std::hypot(point.x() - x, point.y() - y));
      }
    }
  };
  try_box(world.room);
  for (const test::Box& box : world.obstacles) try_box(box);
  return best;
}

class CurvatureTest : public ::testing::Test {
 protected:
  CurvatureTest() {
    // Pillars only: the edges of a table top also cross the rings.
    world_.obstacles.pop_back();
    sweep_ =
        test::Scan(world_, motion_, *rig_.lidar, 0.0, kBegin, RandomStream(3), {.columns = 1800});
    NavState still;
    still.stamp = kBegin;
    deskewed_ = Deskew(sweep_, std::vector<NavState>{still}, *rig_.lidar);
  }

  test::BoxWorld world_ = test::FurnishedRoom();
  test::SwingMotion motion_{.speed = 0.0};
  Rig rig_ = test::MakeTestRig();
  LidarSweep sweep_;
  DeskewedSweep deskewed_;
};

TEST_F(CurvatureTest, EdgesLieAtEdges) {
  const CurvatureFeatures features = FindEdgesAndPlanes(deskewed_, sweep_, rig_.lidar->range_noise);
  ASSERT_GT(features.edges.size(), 100U);
  int beside = 0, ceiling = 0;
  for (const std::size_t i : features.edges) {
    const Eigen::Vector3d point = deskewed_.points[i].cast<double>();
    // Rings also cross the edges between walls and floor or ceiling.
    if (point.z() < world_.room.low.z() + 0.1 || point.z() > world_.room.high.z() - 0.1)
      ++ceiling;
    else if (DistanceToUprightEdge(world_, point) > 0.1)
      ++beside;
  }
  const int upright = static_cast<int>(features.edges.size()) - ceiling;
  EXPECT_GT(upright, 80);
  EXPECT_LT(beside, upright / 20);  // 5 %: 4 sigma pass 3 of 50000 plane points
}

TEST_F(CurvatureTest, PlanesAvoidEdgesAndShadows) {
  const CurvatureFeatures features = FindEdgesAndPlanes(deskewed_, sweep_, rig_.lidar->range_noise);
  ASSERT_GT(features.planes.size(), sweep_.points.size() / 3);
  // In the shadow behind a pillar: a wall point whose neighbour in the ring is a pillar point.
  for (const std::size_t i : features.planes) {
    const std::size_t source = deskewed_.sources[i];
    const std::size_t next = source + rig_.lidar->rings;
    if (next >= sweep_.points.size()) continue;
    const float rise = sweep_.points[next].position.norm() - sweep_.points[source].position.norm();
    EXPECT_GT(rise, -0.3F) << "far side of a jump taken for a plane";
  }
}

TEST_F(CurvatureTest, TheSameAtAnyNumberOfThreads) {
  std::vector<CurvatureFeatures> results;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    results.push_back(FindEdgesAndPlanes(deskewed_, sweep_, 0.01));
  }
  EXPECT_EQ(results[0].edges, results[1].edges);
  EXPECT_EQ(results[0].planes, results[1].planes);
}

TEST_F(CurvatureTest, NeedsRings) {
  sweep_.has_rings = false;
  EXPECT_THROW(FindEdgesAndPlanes(deskewed_, sweep_, 0.01), ContractViolation);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/world.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/base/random.h"
#include "mlvi/sim/mesh_builder.h"
#include "mlvi/sim/places.h"

namespace mlvi {
namespace {

Eigen::Vector3d RandomUnit(RandomStream& random) {
  const double x = random.Normal(), y = random.Normal(), z = random.Normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

// Distance to the nearest triangle by solving o + t d = a + u (b - a) + v (c - a) for each of them.
double NaiveCast(const TriangleMesh& mesh, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(),
                          b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    Eigen::Matrix3d A;
    A << -direction, b - a, c - a;
    if (std::abs(A.determinant()) < 1e-14) continue;
    const Eigen::Vector3d x = A.inverse() * (origin - a);
    if (x[0] > 0.0 && x[1] >= 0.0 && x[2] >= 0.0 && x[1] + x[2] <= 1.0)
      nearest = std::min(nearest, x[0]);
  }
  return nearest;
}

TEST(World, CastAgreesWithAllTrianglesOneByOne) {
  const Place place = MakeCorridor(1);
  RandomStream random(1, "rays");
  int edges = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d origin = place.path.At(random.Uniform(0.0, place.path.length())).position;
    const Eigen::Vector3d direction = RandomUnit(random);
    const auto hit = place.world.Cast(origin, direction, 300.0);
    const double expected = NaiveCast(place.world.mesh(), origin, direction);
    ASSERT_TRUE(hit.has_value()) << "the corridor is closed";
    edges += std::abs(hit->range - expected) > 1e-3;
    EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-6);
    EXPECT_LE(hit->normal.dot(direction), 0.0);
  }
  EXPECT_LE(edges, 1);  // a ray within float rounding of an edge may pass it on the other side
}

TEST(World, BoxIsClosedAndClearanceIsTheDistanceToItsNearestFace) {
  MeshBuilder builder;
  builder.AddBox({1.0, 2.0, 3.0}, {2.0, 4.0, 6.0}, 0.7, builder.AddMaterial("wood", 0.4));
  const World world(std::move(builder).Finish());
  const Eigen::Vector3d centre(1.0, 2.0, 6.0);
  RandomStream random(2, "rays");
  for (int i = 0; i < 500; ++i) {
    const auto hit = world.Cast(centre, RandomUnit(random), 100.0);
    ASSERT_TRUE(hit.has_value());
    EXPECT_GE(hit->range, 1.0 - 1e-5);
    EXPECT_LE(hit->range, std::sqrt(14.0) + 1e-5);
    EXPECT_EQ(hit->material->name, "wood");
  }
  EXPECT_NEAR(world.Clearance(centre, 10.0), 1.0, 0.02);  // rays 16 deg apart
  EXPECT_FALSE(world.Cast(centre, Eigen::Vector3d::UnitZ(), 2.9).has_value());
}

// A box of 0.4 x 0.4 x 1.8 m that runs along x at 2 m/s, with a smaller one turning 3 m above it.
MovingObject Runner() {
  MeshBuilder trunk, hat;
  trunk.AddBox({0.0, 0.0, 0.0}, {0.4, 0.4, 1.8}, 0.0, trunk.AddMaterial("cloth", 0.5));
  hat.AddBox({0.0, 0.0, 0.0}, {1.0, 0.2, 0.2}, 0.0, hat.AddMaterial("hat", 0.9));
  return {.name = "runner",
          .parts = {std::move(trunk).Finish(), std::move(hat).Finish()},
          .poses = [](double seconds, std::span<Pose3> T_world_part) {
            const Eigen::Vector3d at(2.0 * seconds, 5.0, 0.0);
            T_world_part[0] = Pose3::FromTranslation(at);
            T_world_part[1] = Pose3(ExpSo3({0.0, 0.0, seconds}), at + Eigen::Vector3d(0, 0, 3.0));
          }};
}

TriangleMesh Wall(double transmission) {
  MeshBuilder builder;
  const MaterialId wall = builder.AddMaterial({.name = "wall", .transmission = transmission});
  builder.AddQuad({-20, 10, -5}, {20, 10, -5}, {20, 10, 15}, {-20, 10, 15}, wall);
  return std::move(builder).Finish();
}

TEST(World, MovingObjectsAreMetWhereTheyAreAtTheTime) {
  World world(Wall(0.0), {}, {Runner()});
  const Time begin = Time::FromNanoseconds(1'000'000'000'000);
  world.StartClock(begin);
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitY();
  for (const double seconds : {0.0, 0.5, 2.0}) {
    const WorldSnapshot snapshot = world.At(begin + Duration::FromSeconds(seconds));
    const Eigen::Vector3d before(2.0 * seconds + 0.1, 0.0, 1.0);
    const auto hit = snapshot.Cast(before, ahead, 50.0);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->range, 4.8, 1e-5);
    EXPECT_EQ(hit->object, 0);
    EXPECT_EQ(hit->material->name, "cloth");
    EXPECT_NEAR(hit->normal.y(), -1.0, 1e-6);
    EXPECT_TRUE(snapshot.Occluded(before, ahead, 5.0));
    EXPECT_FALSE(snapshot.Occluded(before, ahead, 4.7));
    // Beside it, and the turning part above it: the long side faces along y only at the start.
    EXPECT_EQ(snapshot.Cast(before + Eigen::Vector3d(0.15, 0, 0), ahead, 50.0)->object, -1);
    const auto above = snapshot.Cast({2.0 * seconds, 0.0, 3.1}, ahead, 50.0);
    EXPECT_EQ(above->part, 1);
    // Its side faces the ray until it has turned by a right angle.
    const double facing = seconds < 1.5 ? -1.0 : 1.0;
    EXPECT_NEAR(above->normal.dot(snapshot.PoseOf(0, 1).rotation() * Eigen::Vector3d::UnitY()),
                facing, 1e-6);
  }
}

// Packets against rays one by one: among static triangles and movers, each ray at its own instant.
template <typename Packet>
void ExpectPacketsMeetWhatTheirRaysMeet() {
  constexpr std::size_t kSize = Packet::kSize;
  World world(MakeCourtyard(1).world.mesh(), {}, {Runner()});
  const Time begin = Time::FromNanoseconds(0);
  world.StartClock(begin);
  RandomStream random(3, "packets");
  int met = 0, met_mover = 0, occluded = 0;
  for (int repeat = 0; repeat < 300; ++repeat) {
    std::vector<WorldSnapshot> snapshots;
    for (int i = 0; i < Packet::kSize; ++i)
      snapshots.push_back(world.At(begin + Duration::FromSeconds(0.1 * repeat / 30.0 + 1e-3 * i)));
    const Eigen::Vector3d runner = snapshots.front().PoseOf(0, 0).translation();
    // From around the runner towards it, half of them somewhat past it.
    const Eigen::Vector3d from = runner + 3.0 * RandomUnit(random);
    const Eigen::Vector3d aim = (runner - from).normalized();
    Packet rays;
    rays.coherent = repeat % 2 == 0;
    WorldSnapshot::PerRayOf<kSize> at;
    std::array<Eigen::Vector3f, kSize> directions;
    for (int i = 0; i < Packet::kSize; ++i) {
      const auto k = static_cast<std::size_t>(i);
      at[k] = &snapshots[k];
      directions[k] = (aim + 0.25 * RandomUnit(random)).normalized().cast<float>();
      if (repeat % 3 != 0 || i % 2 == 0) rays.Set(i, from.cast<float>(), directions[k], 20.0F);
    }
    const PacketHitsOf<kSize> hits = WorldSnapshot::Cast(rays, at);
    const unsigned blocked = WorldSnapshot::Occluded(rays, at);
    for (int i = 0; i < Packet::kSize; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Eigen::Vector3f direction = directions[k];
      const PacketHit& hit = hits[k];
      const Eigen::Vector3d o = from.cast<float>().cast<double>(), d = direction.cast<double>();
      const auto expected = snapshots[k].Cast(o, d, 20.0);
      if (!rays.IsActive(i)) {
        EXPECT_EQ(hit.range, 0.0F);
        EXPECT_EQ(blocked >> i & 1U, 0U);
        continue;
      }
      ASSERT_EQ(hit.range > 0.0F, expected.has_value());
      EXPECT_EQ((blocked >> i & 1U) != 0, snapshots[k].Occluded(o, d, 20.0));
      occluded += static_cast<int>(blocked >> i & 1U);
      if (!expected) continue;
      EXPECT_NEAR(hit.range, expected->range, 1e-4);
      EXPECT_EQ(hit.object, expected->object);
      EXPECT_NEAR(hit.normal.cast<double>().dot(expected->normal), 1.0, 1e-4);
      ++met;
      met_mover += hit.object == 0;
    }
  }
  EXPECT_GT(met, 1000);
  EXPECT_GT(met_mover, 200);
  EXPECT_GT(occluded, 1000);
}

TEST(World, PacketsMeetWhatTheirRaysMeet) { ExpectPacketsMeetWhatTheirRaysMeet<RayPacket>(); }

TEST(World, WidePacketsMeetWhatTheirRaysMeet) {
  ExpectPacketsMeetWhatTheirRaysMeet<WideRayPacket>();
}

TEST(World, LightPassesGlassAndRaysMeetIt) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), ahead = Eigen::Vector3d::UnitY();
  const World solid(Wall(0.0)), glass(Wall(0.8));
  EXPECT_TRUE(solid.At(Time::FromNanoseconds(0)).Occluded(origin, ahead, 20.0));
  EXPECT_FALSE(glass.At(Time::FromNanoseconds(0)).Occluded(origin, ahead, 20.0));
  EXPECT_NEAR(glass.Cast(origin, ahead, 20.0)->range, 10.0, 1e-5);
}

TEST(World, RefusesBrokenMeshes) {
  TriangleMesh mesh;
  EXPECT_THROW(World{mesh}, ContractViolation);
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.triangle_materials = {0};
  mesh.materials = {{.name = "air"}};
  EXPECT_THROW(World{mesh}, ContractViolation);
}

TEST(MeshBuilder, PanelsAreWholeButForTheirHoles) {
  MeshBuilder builder;
  const MaterialId wall = builder.AddMaterial("wall", 0.5), pane = builder.AddMaterial("pane", 0.1);
  const PanelFrame frame{
      .corner = {0.0, 0.0, 0.0}, .width = 10.0, .height = 4.0};  // normal along -y
  builder.AddPanel(frame, wall,
                   {{.u0 = 1.0, .u1 = 2.0, .v0 = 1.0, .v1 = 3.0, .depth = 0.3, .back = pane},
                    {.u0 = 6.0, .u1 = 7.5, .v0 = 0.0, .v1 = 2.0, .depth = 0.0, .open = true}});
  const World world(std::move(builder).Finish());
  RandomStream random(3, "points");
  for (int i = 0; i < 1000; ++i) {
    const double u = random.Uniform(0.01, 9.99), v = random.Uniform(0.01, 3.99);
    const auto hit = world.Cast({u, -1.0, v}, Eigen::Vector3d::UnitY(), 10.0);
    const bool window = u > 1.0 && u < 2.0 && v > 1.0 && v<3.0, door = u> 6.0 && u < 7.5 && v < 2.0;
    ASSERT_EQ(hit.has_value(), !door) << u << " " << v;
    if (!hit) continue;
    EXPECT_NEAR(hit->range, window ? 1.3 : 1.0, 1e-5);
    EXPECT_EQ(hit->material->name, window ? "pane" : "wall");
  }
}

TEST(WalkingPath, ClosesAndAdvancesByArcLength) {
  for (const Place& place : {MakeCourtyard(1), MakeCorridor(1)}) {
    const WalkingPath& path = place.path;
    EXPECT_LT((path.At(0.0).position - path.At(path.length()).position).norm(), 1e-9);
    const double turns =
        (path.At(path.length()).heading - path.At(0.0).heading) / (2.0 * std::numbers::pi);
    EXPECT_NEAR(turns, std::round(turns), 1e-9);
    for (double s = 0.0; s < 1.2 * path.length(); s += 0.1) {
      const PathPoint a = path.At(s), b = path.At(s + 0.1);
      EXPECT_NEAR((b.position - a.position).norm(), 0.1, 0.005) << s;
      EXPECT_LT(std::abs(b.heading - a.heading), 0.5) << s;
    }
  }
}

// What the corridor is for: over long stretches nearly no return tells the motion along it.
TEST(Corridor, HidesTheMotionAlongIt) {
  const Place place = MakeCorridor(1);
  const Eigen::Vector3d middle(32.5, 0.0, 1.4);
  RandomStream random(4, "rays");
  int along = 0, all = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto hit = place.world.Cast(middle, RandomUnit(random), 50.0);
    ASSERT_TRUE(hit.has_value());
    ++all;
    // Seen by an OS0-128 (LidarPhysics, reference range 50 m) with more than an even chance.
    const double power = hit->material->reflectivity / 0.8 * std::pow(50.0 / hit->range, 2);
    along += std::abs(hit->normal.x()) > 0.3 && power > 1.0;
  }
  EXPECT_LT(along, all / 1000);
}

}  // namespace
}  // namespace mlvi

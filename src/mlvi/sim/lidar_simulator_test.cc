// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "mlvi/base/parallel.h"
#include "mlvi/sim/averaged_relief.h"
#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

class Lidars : public ::testing::TestWithParam<std::tuple<int, std::string>> {
 protected:
  static Rig MakeRig(int which) {
    return which == 0 ? test::NewerCollege() : which == 1 ? test::M2dgr() : test::Hilti();
  }
};

// The law of the simulator: undo the motion with the true trajectory, and every return lies on the
// mesh along its own beam, within the range noise; the noise has the specified size.
TEST_P(Lidars, ReturnsLieOnTheMeshAfterExactDeskewing) {
  const auto& [which, sequence] = GetParam();
  SequenceOptions options = StandardSequence(sequence, MakeRig(which), 1.0, 3);
  options.rest = 0.0;
  const Recording recording(options);
  LidarPattern pattern = recording.lidar().pattern();
  pattern.physics.beam_noise = 0.0;  // so that the nominal beam is the true one
  const Pose3 T_body_lidar = options.rig.true_rig.lidar->T_body_lidar;
  const LidarSimulator lidar(pattern, T_body_lidar, RandomStream(5));
  const Time stamp = recording.begin() + Duration::FromMilliseconds(500);
  const LidarSweep sweep = lidar.Sweep(recording.world(), recording.motion(), stamp, 0);
  double sum = 0.0, squares = 0.0;
  std::size_t returns = 0, ring_errors = 0;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const LidarPoint& p = sweep.points[i];
    ring_errors += p.ring != pattern.rays[i].ring;
    if (p.position.isZero(0.0F)) continue;
    const Pose3 T_world_lidar =
        recording.motion().PoseAt(stamp + Duration::FromNanoseconds(p.offset_ns)) * T_body_lidar;
    const Eigen::Vector3d origin = T_world_lidar * pattern.rays[i].origin.cast<double>();
    const Eigen::Vector3d ray = T_world_lidar * p.position.cast<double>() - origin;
    const auto hit = recording.world().Cast(origin, ray.normalized(), 300.0);
    ASSERT_TRUE(hit.has_value()) << i;
    const double error = ray.norm() - hit->range;
    // Rays along an edge may see the other side of it after rounding to float: a handful, not
    // asserted one by one.
    if (std::abs(error) > 6.0 * pattern.physics.range_noise + 0.01) continue;
    sum += error, squares += error * error, ++returns;
  }
  const auto all = static_cast<std::size_t>(
      std::count_if(sweep.points.begin(), sweep.points.end(),
                    [](const LidarPoint& p) { return !p.position.isZero(0.0F); }));
  ASSERT_GT(all, pattern.rays.size() / 3);
  EXPECT_EQ(ring_errors, 0U);
  EXPECT_GE(returns + all / 2000, all);
  const double n = static_cast<double>(returns), sigma = pattern.physics.range_noise;
  EXPECT_NEAR(sum / n, 0.0, 5.0 * sigma / std::sqrt(n) + 1e-5);
  EXPECT_NEAR(std::sqrt(squares / n), sigma, 0.02 * sigma);
  RecordProperty("share_of_returns", std::to_string(static_cast<double>(all) /
                                                    static_cast<double>(pattern.rays.size())));
}

// Most beams find something; what is missing is sky, far grazing ground, glass, and random
// dropouts.
TEST_P(Lidars, WorldsAreClosedEnough) {
  const auto& [which, sequence] = GetParam();
  const Recording recording(StandardSequence(sequence, MakeRig(which), 1.0));
  const LidarSweep sweep =
      recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 0);
  const auto returns = std::count_if(sweep.points.begin(), sweep.points.end(),
                                     [](const LidarPoint& p) { return !p.position.isZero(0.0F); });
  const double share = static_cast<double>(returns) / static_cast<double>(sweep.points.size());
  RecordProperty("share_of_returns", std::to_string(share));
  EXPECT_GT(share, 0.8) << sequence;
}

INSTANTIATE_TEST_SUITE_P(Models, Lidars,
                         ::testing::Combine(::testing::Values(0, 1, 2),
                                            ::testing::Values("courtyard-hard", "corridor-easy")));

// Whatever a ray may come back from, by tracing it without regard to energies: surfaces behind
// panes and in mirrors, too.
struct Candidate {
  double range = 0.0;   // m, to the mesh
  double relief = 0.0;  // m, by which the way ends before it
  EchoPath path = EchoPath::kDirect;
};
void Collect(const WorldSnapshot& world, const Eigen::Vector3d& origin,
             const Eigen::Vector3d& direction, const Candidate& way, int surfaces,
             std::vector<Candidate>& found, double spread = 0.0) {
  const auto hit = world.Cast(origin, direction, 300.0);
  if (!hit) return;
  const Material& material = *hit->material;
  Candidate here{.range = way.range + hit->range, .path = way.path};
  if (hit->object < 0) {
    const double cosine = -hit->normal.dot(direction);
    here.relief = world.world().relief().ShortensBy(
        AveragedRelief(material.relief, spread * hit->range, cosine),
        origin + hit->range * direction, direction, cosine);
  }
  found.push_back(here);
  if (surfaces == 1 || (material.transmission == 0.0 && material.lidar_mirror == 0.0)) return;
  const Eigen::Vector3d point = origin + hit->range * direction;
  const Eigen::Matrix3d householder =
      Eigen::Matrix3d::Identity() - 2.0 * hit->normal * hit->normal.transpose();
  const auto behind = [&](const Eigen::Vector3d& onward, EchoPath path) {
    Collect(world, point + 1e-3 * onward, onward,
            {.range = here.range + 1e-3, .path = std::max(path, way.path)}, surfaces - 1, found);
  };
  behind(householder * direction, EchoPath::kMirrored);
  behind(direction, EchoPath::kTransmitted);
}

// Of all triangles that a point lies on, to 1 mm: where two share a place either may be met.
std::vector<const Material*> MaterialsAt(const TriangleMesh& mesh, const Eigen::Vector3d& point) {
  std::vector<const Material*> materials;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
      return mesh.vertices[mesh.triangles[i][k]].cast<double>() - point;
    };
    const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    if (!(std::abs(normal.dot(a)) < 1e-3)) continue;
    const double room = 1e-3 * (a.norm() + b.norm() + c.norm());
    if (a.cross(b).dot(normal) > -room && b.cross(c).dot(normal) > -room &&
        c.cross(a).dot(normal) > -room)
      materials.push_back(&mesh.materials[mesh.triangle_materials[i]]);
  }
  return materials;
}

struct EchoCase {
  std::string sequence;
  int rig = 0;  // 0: newer_college, 1: m2dgr, 2: hilti_2022
  double seconds = 0.5;
};

class Echoes : public ::testing::TestWithParam<EchoCase> {
 protected:
  // Of a sweep of the sequence, beams undisturbed.
  struct Shot {
    LidarPoint point;
    LidarReturn truth;
    WorldSnapshot world;
    Eigen::Vector3d origin, ray;  // world; the ray to the point
  };
  template <typename Visit>
  static void ForEachReturn(double beam_divergence_share, const Visit& visit) {
    const EchoCase& at = GetParam();
    const Rig rig = at.rig == 0   ? test::NewerCollege()
                    : at.rig == 1 ? test::M2dgr()
                                  : test::Hilti();
    const Recording recording(StandardSequence(at.sequence, rig, at.seconds + 0.2, 3));
    LidarPattern pattern = recording.lidar().pattern();
    pattern.physics.beam_noise = 0.0;
    pattern.physics.beam_divergence *= beam_divergence_share;
    const Pose3 T_body_lidar = recording.options().rig.true_rig.lidar->T_body_lidar;
    const LidarSimulator lidar(pattern, T_body_lidar, RandomStream(5));
    const Time stamp = recording.begin() + Duration::FromSeconds(at.seconds);
    const TracedSweep traced = lidar.Trace(recording.world(), recording.motion(), stamp, 0);
    for (std::size_t i = 0; i < traced.returns.size(); ++i) {
      const LidarPoint& point = traced.sweep.points[i];
      if (point.position.isZero(0.0F)) continue;
      const Time fired = stamp + Duration::FromNanoseconds(point.offset_ns);
      const Pose3 T_world_lidar = recording.motion().PoseAt(fired) * T_body_lidar;
      const Eigen::Vector3d origin = T_world_lidar * pattern.rays[i].origin.cast<double>();
      const Eigen::Vector3d ray = T_world_lidar * point.position.cast<double>() - origin;
      visit(pattern, i, Shot{point, traced.returns[i], recording.world().At(fired), origin, ray});
    }
  }
};

// What is wrong with a range beside its truth is the specified bias and noise, however the light
// came.
TEST_P(Echoes, RangesErrByBiasAndNoise) {
  struct Moments {
    double sum = 0.0, squares = 0.0, n = 0.0;
  };
  std::map<std::pair<EchoPath, bool>, Moments> classes;
  Moments all;
  double sigma = 0.0;
  ForEachReturn(1.0, [&](const LidarPattern& pattern, std::size_t i, const Shot& shot) {
    const LidarPhysics& physics = pattern.physics;
    sigma = std::hypot(physics.range_noise, physics.range_resolution / std::sqrt(12.0));
    const double range = shot.truth.range + pattern.rays[i].origin_offset;
    const double bias = RangeBias(physics, range, shot.truth.cosine, shot.truth.reflectivity);
    const double error = shot.ray.norm() - shot.truth.range - bias;
    for (Moments* m : {&all, &classes[{shot.truth.path, shot.truth.mixed()}]})
      m->sum += error, m->squares += error * error, m->n += 1.0;
  });
  ASSERT_GT(all.n, 10000.0);
  EXPECT_NEAR(std::sqrt(all.squares / all.n), sigma, 0.02 * sigma);
  for (const auto& [which, m] : classes) {
    EXPECT_NEAR(m.sum / m.n, 0.0, 5.0 * sigma / std::sqrt(m.n) + 1e-5)
        << static_cast<int>(which.first) << (which.second ? " mixed" : "");
    RecordProperty("echoes_" + std::to_string(static_cast<int>(which.first)) +
                       (which.second ? "_mixed" : "_alone"),
                   std::to_string(m.n));
  }
}

// A ray without width: direct echoes lie on the mesh but for the relief that the truth tells,
// transmitted ones on what is behind the pane, mirrored ones on the mirrored mesh.
TEST_P(Echoes, RaysComeBackFromWhatTheirPathMeets) {
  std::size_t all = 0, wrong = 0;
  ForEachReturn(0.0, [&](const LidarPattern&, std::size_t, const Shot& shot) {
    if (shot.truth.mixed()) return;  // a pane and what is close behind it
    const auto comes_from = [&](const Eigen::Vector3d& direction) {
      std::vector<Candidate> candidates;
      Collect(shot.world, shot.origin, direction, {}, 3, candidates);
      return std::ranges::any_of(candidates, [&](const Candidate& c) {
        return c.path == shot.truth.path &&
               std::abs(c.range - shot.truth.range - shot.truth.relief) < 1e-3;
      });
    };
    ++all;
    // Rays along an edge, 0.1 mm from it at 6 m, may see the other side of it after rounding to
    // float.
    wrong += std::ranges::none_of(BeamDirections(shot.ray.normalized(), 2e-5), comes_from);
  });
  ASSERT_GT(all, 10000U);
  EXPECT_LT(wrong, 1 + all / 2000);
}

// Relief belongs to the wall: whatever ray comes back from it, where it ends the surface stands out
// of the mesh by the height that is there; and it is as rough as its materials say.
TEST_P(Echoes, DirectReturnsEndOnTheReliefOfTheirSurface) {
  std::size_t all = 0, off = 0;
  struct Roughness {
    double squares = 0.0, promised = 0.0;
  };
  std::map<std::array<int, 3>, Roughness> cells;  // of a metre, which has a bump or two
  ForEachReturn(1.0, [&](const LidarPattern&, std::size_t, const Shot& shot) {
    const LidarReturn& truth = shot.truth;
    if (truth.mixed() || truth.path != EchoPath::kDirect) return;
    const Eigen::Vector3d direction = shot.ray.normalized();
    const auto hit = shot.world.Cast(shot.origin, direction, 300.0);
    if (!hit || hit->object >= 0 || truth.cosine < 0.2) return;
    if (std::abs(truth.range + truth.relief - hit->range) > 1e-3) return;  // the test above
    // Where two surfaces lie in one place either is met.
    const Eigen::Vector3d behind = shot.origin + (hit->range + 1e-4) * direction;
    if (shot.world.Cast(behind, direction, 1e-3)) return;
    const Relief relief =
        AveragedRelief(hit->material->relief, truth.spread * hit->range, truth.cosine);
    const Eigen::Vector3d end = shot.origin + truth.range * direction;
    const double height = hit->normal.dot(end - shot.origin - hit->range * direction);
    const double there = shot.world.world().relief().HeightAt(relief, end);
    ++all;
    off += std::abs(height - there) > 5e-4 &&
           std::ranges::none_of(
               MaterialsAt(shot.world.world().mesh(), end - height * hit->normal),
               [&](const Material* material) {
                 const auto& surface = shot.world.world().relief();
                 return std::abs(height - surface.HeightAt(material->relief, end)) < 5e-4;
               });
    const Eigen::Vector3d metres = end.array().floor();
    Roughness& cell = cells[{int(metres.x()), int(metres.y()), int(metres.z())}];
    cell.squares += height * height;
    cell.promised += relief.fine * relief.fine + relief.coarse * relief.coarse;
  });
  ASSERT_GT(all, 10000U);
  EXPECT_LT(off, 1 + all / 500);
  double ratios = 0.0, rough = 0.0;
  for (const auto& [where, cell] : cells) {
    if (cell.promised == 0.0) continue;
    ratios += cell.squares / cell.promised;
    rough += 1.0;
  }
  ASSERT_GT(rough, 50.0);
  // A square of a normal height has the variance 2.
  EXPECT_NEAR(ratios / rough, 1.0, 5.0 * std::sqrt(2.0 / rough));
  RecordProperty("rough_cells", std::to_string(rough));
  RecordProperty("ratio", std::to_string(ratios / rough));
}

// Whole beams: a mixed pixel lies between surfaces that rays of its beam meet, any other on that
// which its middle meets first.
TEST_P(Echoes, MixedPixelsLieBetweenSurfaces) {
  std::size_t all = 0, mixed = 0, wrong = 0;
  ForEachReturn(1.0, [&](const LidarPattern& pattern, std::size_t i, const Shot& shot) {
    if (i % 4 != 0) return;
    const LidarReturn& truth = shot.truth;
    const auto beam = BeamDirections(shot.ray.normalized(), pattern.physics.beam_divergence);
    std::vector<Candidate> candidates;
    for (const Eigen::Vector3d& direction : beam)
      Collect(shot.world, shot.origin, direction, {}, 3, candidates);
    Collect(shot.world, shot.origin, beam.front(), {}, 1, candidates, truth.spread);
    const auto meets = [&](double range) {
      return std::ranges::any_of(candidates, [&](const Candidate& c) {
        return std::abs(c.range - c.relief - range) < 2e-3;
      });
    };
    ++all;
    mixed += truth.mixed();
    EXPECT_LE(truth.nearest, truth.range + 1e-9);
    EXPECT_LE(truth.range, truth.farthest + 1e-9);
    EXPECT_LE(truth.farthest - truth.nearest, pattern.physics.pulse_length + 1e-9);
    wrong += !meets(truth.nearest) || !meets(truth.farthest);
  });
  ASSERT_GT(all, 2500U);
  EXPECT_GT(mixed, 0U);
  EXPECT_LT(wrong, 1 + all / 1000);
  RecordProperty("mixed_share",
                 std::to_string(static_cast<double>(mixed) / static_cast<double>(all)));
}

INSTANTIATE_TEST_SUITE_P(Worlds, Echoes,
                         ::testing::Values(EchoCase{"hall-05", 1}, EchoCase{"door-02", 1},
                                           EchoCase{"stairs", 0, 10.0}, EchoCase{"walk-01", 1},
                                           EchoCase{"corridor-lower-gallery-2", 2}),
                         [](const auto& instance) {
                           std::string name = instance.param.sequence;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// Glass, people and cars, whole beams: same bits at any number of threads.
TEST(LidarSimulator, EchoesHaveTheSameBitsAtEveryNumberOfThreads) {
  const Recording recording(StandardSequence("hall-05", test::M2dgr(), 0.3));
  const auto sweep = [&](int threads) {
    const ThreadLimit limit(threads);
    return recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 1);
  };
  const LidarSweep one = sweep(1);
  for (const int threads : {2, 4}) {
    const LidarSweep other = sweep(threads);
    ASSERT_EQ(other.points.size(), one.points.size());
    for (std::size_t i = 0; i < one.points.size(); ++i) {
      ASSERT_EQ(other.points[i].position, one.points[i].position) << i;
      ASSERT_EQ(other.points[i].intensity, one.points[i].intensity) << i;
    }
  }
}

TEST(LidarPattern, MatchesTheSensors) {
  const LidarPattern os0 = MakeLidarPattern("OS0-128").value();
  EXPECT_EQ(os0.rays.size(), 128U * 1024U);
  EXPECT_EQ(os0.rays[1024].ring, 1);  // organised ring by ring
  EXPECT_EQ(os0.firing_offsets_ns[1], 97656);
  EXPECT_NEAR(os0.rays[0].direction.z(), std::sin(45.75 * M_PI / 180.0), 1e-6);
  // Before the first column's 11.24 deg offset the head looks backwards, and it turns clockwise.
  EXPECT_LT(os0.rays[0].origin.x(), -0.02F);
  EXPECT_GT(os0.rays[256].origin.y(), 0.02F);
  const LidarPattern vlp = MakeLidarPattern("VLP-32C").value();
  EXPECT_EQ(vlp.rays.size(), 32U * 1808U);
  EXPECT_EQ(vlp.firing_offsets_ns.size(), 16U * 1808U);
  EXPECT_EQ(vlp.rays[1].ring, 17);  // laser 1
  EXPECT_EQ(vlp.rays[0].firing, vlp.rays[1].firing);
  const LidarPattern xt = MakeLidarPattern("PandarXT-32").value();
  EXPECT_EQ(xt.rays.size(), 32U * 2000U);
  for (const LidarPattern* p : {&os0, &vlp, &xt}) {
    EXPECT_TRUE(std::is_sorted(p->firing_offsets_ns.begin(), p->firing_offsets_ns.end()));
    EXPECT_EQ(p->firing_offsets_ns.front(), 0);
    EXPECT_LT(p->span().seconds(), 0.1);
    EXPECT_GT(p->span().seconds(), 0.0995);
  }
  EXPECT_FALSE(MakeLidarPattern("HDL-64").has_value());
}

}  // namespace
}  // namespace mlvi

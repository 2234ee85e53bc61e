// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Every sequence of the catalogue, with its own rig: room to move, motion as its profile promises,
// first sweeps as the place demands.
#include "mlvi/sim/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <set>

#include "mlvi/sim/recording.h"
#include "mlvi/sim/test_rigs.h"

namespace mlvi {
namespace {

using ::testing::AllOf;
using ::testing::Ge;
using ::testing::Le;

constexpr double kDegree = std::numbers::pi / 180.0;

Rig RigOf(const SequenceInfo& info) {
  if (info.rig == "m2dgr") return test::M2dgr();
  if (info.rig == "hilti_2022") return test::Hilti();
  return test::NewerCollege();
}

struct Band {
  double low, high;
};

// What a LiDAR sees from the start: share of rays that return, and quantiles of their ranges, m.
struct Expectation {
  std::string sequence;
  Band returns, median, p90;
};

const std::vector<Expectation>& Expectations() {
  static const std::vector<Expectation> expectations = {
      {"quad-easy", {0.67, 0.81}, {4.0, 7.0}, {17.7, 30.7}},
      {"math-easy", {0.76, 0.90}, {4.4, 7.7}, {11.3, 19.5}},
      {"undermine-hard", {0.91, 1.00}, {1.5, 2.6}, {3.4, 5.8}},
      {"stairs", {0.91, 1.00}, {2.0, 3.4}, {3.7, 6.4}},
      {"cloister", {0.87, 1.00}, {2.1, 3.6}, {5.4, 9.3}},
      {"room-01", {0.91, 1.00}, {3.2, 5.6}, {5.5, 9.6}},
      {"hall-05", {0.91, 1.00}, {4.3, 7.4}, {14.2, 24.7}},
      {"door-02", {0.91, 1.00}, {1.5, 2.5}, {3.0, 5.2}},
      {"gate-03", {0.70, 0.84}, {8.8, 15.3}, {18.5, 32.0}},
      {"walk-01", {0.82, 0.96}, {5.0, 8.6}, {16.3, 28.2}},
      {"construction-upper-level-3", {0.59, 0.73}, {6.9, 12.0}, {28.5, 49.4}},
      {"basement-2", {0.91, 1.00}, {2.7, 4.7}, {5.2, 9.0}},
      {"attic-to-upper-gallery-2", {0.91, 1.00}, {2.8, 4.8}, {4.8, 8.4}},
      {"corridor-lower-gallery-2", {0.91, 1.00}, {2.9, 5.0}, {3.5, 6.1}},
  };
  return expectations;
}

// Smallest distance from `point` to anything, moving or not, as seen by 400 rays.
double Clearance(const WorldSnapshot& world, const Eigen::Vector3d& point, double max_range) {
  constexpr int kRays = 400;
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < kRays; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kRays, radius = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d ray(radius * std::cos(golden_angle * i),
                              radius * std::sin(golden_angle * i), z);
    if (const auto hit = world.Cast(point, ray, max_range)) max_range = hit->range;
  }
  return max_range;
}

class Sequences : public ::testing::TestWithParam<SequenceInfo> {};

TEST_P(Sequences, KeepAwayFromEverythingThatStandsOrMoves) {
  SequenceOptions options = StandardSequence(GetParam().name, RigOf(GetParam()));
  options.carried = false;  // who carries the rig is as near as can be
  const Recording recording(options);
  double smallest = 5.0, when = 0.0;
  for (double t = 0.0; t < GetParam().seconds; t += 0.1) {
    const Time time = recording.begin() + Duration::FromSeconds(t);
    const double clearance = Clearance(recording.world().At(time),
                                       recording.motion().PoseAt(time).translation(), smallest);
    if (clearance < smallest) when = t;
    smallest = std::min(smallest, clearance);
  }
  RecordProperty("clearance", std::to_string(smallest));
  EXPECT_GT(smallest, 0.3) << "at " << when << " s";
}

// Angular rates in deg/s, accelerations in m/s^2, after the start.
struct MotionBands {
  Band mean_rate, p95_rate, max_rate, max_acceleration, speed;
};

MotionBands BandsOf(MotionProfile (*profile)()) {
  if (profile == &EasyMotion) return {{10, 20}, {20, 45}, {30, 80}, {0.5, 6.0}, {0.8, 1.7}};
  if (profile == &MediumMotion) return {{25, 60}, {45, 80}, {85, 110}, {4.0, 6.0}, {0.9, 1.7}};
  if (profile == &HardMotion) return {{45, 110}, {100, 180}, {172, 230}, {7.0, 10.0}, {0.9, 1.9}};
  if (profile == &StairsMotion) return {{10, 40}, {25, 80}, {40, 120}, {0.5, 6.0}, {0.4, 0.9}};
  // RIGS 4.4: p95 64, max 145 deg/s, 0.6 m/s; p95 132, max 264 deg/s.
  if (profile == &SurveyMotion) return {{15, 45}, {50, 80}, {125, 170}, {3.0, 6.0}, {0.4, 0.9}};
  if (profile == &HastySurveyMotion)
    return {{30, 90}, {105, 155}, {225, 300}, {6.0, 10.0}, {0.5, 1.2}};
  // M2DGR hall_03: 0.77 m/s.
  if (profile == &RobotMotion) return {{1, 20}, {2, 60}, {15, 110}, {0.5, 3.5}, {0.5, 0.9}};
  return {{1, 30}, {2, 60}, {15, 110}, {0.5, 3.5}, {0.3, 0.6}};
}

void ExpectWithin(const char* what, double value, const Band& band) {
  ::testing::Test::RecordProperty(what, std::to_string(value));
  EXPECT_THAT(value, AllOf(Ge(band.low), Le(band.high))) << what;
}

TEST_P(Sequences, MoveAsTheirProfilePromises) {
  const Recording recording(StandardSequence(GetParam().name, RigOf(GetParam())));
  const MotionStatistics m = MeasureMotion(
      recording.motion(), recording.begin() + Duration::FromSeconds(4.0), recording.end());
  const MotionBands bands = BandsOf(GetParam().make_profile);
  ExpectWithin("mean_rate", m.mean_rate / kDegree, bands.mean_rate);
  ExpectWithin("p95_rate", m.p95_rate / kDegree, bands.p95_rate);
  ExpectWithin("max_rate", m.max_rate / kDegree, bands.max_rate);
  ExpectWithin("max_acceleration", m.max_acceleration, bands.max_acceleration);
  ExpectWithin("speed", m.mean_speed, bands.speed);
}

// Where the profile has stops the body comes to rest, again and again; else it never does.
TEST_P(Sequences, StopWhereTheirProfileSays) {
  const MotionProfile profile = GetParam().make_profile();
  const Recording recording(StandardSequence(GetParam().name, RigOf(GetParam())));
  int stops = 0;
  bool moving = false;
  for (double t = 4.0; t < GetParam().seconds - 4.0; t += 0.1) {
    const double speed =
        recording.GroundTruth(recording.begin() + Duration::FromSeconds(t)).v_world_body.norm();
    stops += moving && speed < 0.05 ? 1 : 0;
    moving = speed > 0.2 || (moving && speed >= 0.05);
  }
  RecordProperty("stops", stops);
  const double expected = profile.pause_every == 0.0
                              ? 0.0
                              : GetParam().seconds / (profile.pause_every + profile.pause + 2.0);
  EXPECT_NEAR(stops, expected, profile.pause_every == 0.0 ? 0.0 : 0.25 * expected + 1.5);
}

// What comes by the same place again at least 15 s later, within 2 m: as it did before, or the
// other way round (directions of motion more than 120 deg apart).
struct Revisits {
  bool alike = false, opposite = false;
};

Revisits RevisitsOf(const Recording& recording) {
  std::vector<NavState> states;
  for (Time t = recording.begin() + Duration::FromSeconds(4.0); t < recording.end();
       t = t + Duration::FromMilliseconds(250)) {
    const NavState state = recording.GroundTruth(t);
    if (state.v_world_body.norm() > 0.2) states.push_back(state);
  }
  Revisits found;
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const NavState &now = states[i], &then = states[k];
      if (now.stamp - then.stamp < Duration::FromSeconds(15.0)) continue;
      if ((now.T_world_body.translation() - then.T_world_body.translation()).norm() > 2.0) continue;
      const double cosine = now.v_world_body.normalized().dot(then.v_world_body.normalized());
      found.alike = found.alike || cosine > 0.9;
      found.opposite = found.opposite || cosine < -0.5;
    }
  }
  return found;
}

TEST(SequenceCatalogue, ComesBackWherePromised) {
  for (const std::string name : {"room-01", "room-02", "room-03", "cloister"})
    EXPECT_TRUE(RevisitsOf(Recording(StandardSequence(name, RigOf(*FindSequence(name))))).alike)
        << name;
  for (const std::string name : {"quad-easy", "quad-hard", "math-easy", "math-hard", "stairs",
                                 "attic-to-upper-gallery-2", "corridor-lower-gallery-2"}) {
    EXPECT_TRUE(RevisitsOf(Recording(StandardSequence(name, RigOf(*FindSequence(name))))).opposite)
        << name;
  }
}

TEST(RobotMotionTest, StandsStillAtRestAndInItsStops) {
  const SequenceInfo* info = FindSequence("room-01");
  ASSERT_NE(info, nullptr);
  const SequenceOptions options = StandardSequence(info->name, RigOf(*info));
  const Recording recording(options);
  const MotionProfile profile = RobotMotion();
  const double stop = options.rest + profile.pause_every + 1.0;
  for (const double begin : {0.0, stop}) {
    const double end = begin == 0.0 ? options.rest : begin + profile.pause;
    const auto pose = [&](double t) {
      return recording.motion().PoseAt(recording.begin() + Duration::FromSeconds(t));
    };
    EXPECT_LT(BoxMinus(pose(begin + 0.1), pose(end - 0.1)).norm(), 1e-9) << begin;
    EXPECT_GT(BoxMinus(pose(end - 0.1), pose(end + 2.0)).norm(), 0.1) << "then it drives on";
  }
}

class FirstSweeps : public ::testing::TestWithParam<Expectation> {};

TEST_P(FirstSweeps, AreThoseOfTheirPlace) {
  const Expectation& expected = GetParam();
  const SequenceInfo* info = FindSequence(expected.sequence);
  ASSERT_NE(info, nullptr);
  SequenceOptions options = StandardSequence(info->name, RigOf(*info));
  options.carried = false;
  const Recording recording(options);
  const LidarSweep sweep =
      recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 0);
  std::vector<double> ranges;
  for (const LidarPoint& point : sweep.points) {
    const double range = point.position.cast<double>().norm();
    if (range > 0.0) ranges.push_back(range);
  }
  ASSERT_FALSE(ranges.empty());
  std::sort(ranges.begin(), ranges.end());
  const auto quantile = [&](double q) {
    return ranges[static_cast<std::size_t>(q * static_cast<double>(ranges.size() - 1))];
  };
  ExpectWithin("returns",
               static_cast<double>(ranges.size()) / static_cast<double>(sweep.points.size()),
               expected.returns);
  ExpectWithin("median", quantile(0.5), expected.median);
  ExpectWithin("p90", quantile(0.9), expected.p90);
}

// The person who carries a handheld rig hides a part of the way round, all of it behind the rig,
// and is as near as arms and trunk are, at rest and in motion; robots have nobody.
TEST(Operators, StandBehindTheRig) {
  for (const std::string name : {"quad-hard", "basement-2", "room-01", "courtyard-easy"}) {
    const SequenceInfo& info = *FindSequence(name);
    const bool handheld = name == "quad-hard" || name == "basement-2";
    const Recording recording(StandardSequence(name, RigOf(info), 20.0));
    ASSERT_EQ(recording.options().carried, handheld) << name;
    if (!handheld) continue;
    const Pose3 T_body_lidar = recording.options().rig.true_rig.lidar->T_body_lidar;
    const Eigen::Quaterniond carried = CarriedOrientation(recording.options().rig.true_rig);
    const int person = static_cast<int>(recording.world().movers().size()) - 1;
    for (const double t : {0.0, 5.0, 12.0}) {
      const Time time = recording.begin() + Duration::FromSeconds(t);
      const Pose3 T_world_carrier =
          recording.motion().PoseAt(time) * Pose3(carried.conjugate(), Eigen::Vector3d::Zero());
      const Eigen::Vector3d lidar = recording.motion().PoseAt(time) * T_body_lidar.translation();
      const WorldSnapshot world = recording.world().At(time);
      double hidden = 0.0, ahead = 0.0;
      for (int degree = 0; degree < 360; ++degree) {
        const double angle = degree * kDegree;
        const Eigen::Vector3d ray =
            T_world_carrier.rotation() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
        const auto hit = world.Cast(lidar, ray, 100.0);
        if (!hit || hit->object != person) continue;
        ExpectWithin("range", hit->range, {0.1, 0.9});
        hidden += 1.0;
        ahead += std::cos(angle) > 0.3 ? 1.0 : 0.0;
      }
      // A trunk with its shoulders, 0.4 to 0.5 m wide, 0.42 m away; shaken when waved about.
      ExpectWithin("hidden", hidden, {30.0, 90.0});
      EXPECT_EQ(ahead, 0.0) << name << " after " << t << " s";
    }
  }
}

// Somebody with another rig: the LiDAR on a boom behind the IMU. The person steps back, as far as
// is needed to hide no more of the view than of other rigs; a robot nobody carries.
TEST(Operators, StepBackFromWhatTheyCarry) {
  const auto near = [](const Rig& rig) {
    const Recording recording(StandardSequence("quad-easy", rig, 0.1));
    const LidarSweep sweep =
        recording.lidar().Sweep(recording.world(), recording.motion(), recording.begin(), 0);
    std::size_t returns = 0, close = 0;
    for (const LidarPoint& point : sweep.points) {
      returns += point.position.isZero(0.0F) ? 0 : 1;
      close += !point.position.isZero(0.0F) && point.position.norm() < 1.0F ? 1 : 0;
    }
    return static_cast<double>(close) / static_cast<double>(returns);
  };
  Rig rig = test::NewerCollege();
  const double usual = near(rig);
  EXPECT_GT(usual, 0.02);  // 30 deg are 0.08, hardly half of it below 1 m
  rig.name = "boom";
  Pose3& mount = rig.lidar->T_body_lidar;
  mount = Pose3(mount.rotation(), mount.translation() - Eigen::Vector3d(0.4, 0.0, 0.0));
  EXPECT_NEAR(near(rig), usual, 0.05);
  mount = Pose3(mount.rotation(), {0.9, 0.0, 0.0});
  EXPECT_FALSE(CanBeCarried(rig));
  EXPECT_FALSE(Recording(StandardSequence("quad-easy", rig, 0.1)).options().carried);
}

// What is not the handheld rigs' IMU has the noise of its file and nothing else; when vibration is
// asked for, the estimator is told of it.
TEST(StandardSequence, GivesTheErrorsOfARigsImuToThatRigOnly) {
  EXPECT_TRUE(HasErrors(StandardSequence("quad-hard", test::NewerCollege()).imu_errors));
  EXPECT_FALSE(HasErrors(StandardSequence("quad-easy", test::NewerCollege()).imu_errors));
  Rig rig = test::NewerCollege();
  rig.name = "mine";
  rig.imu.noise = {1.1e-3, 2.3e-4, 3.4e-5, 8.3e-6};
  SequenceOptions options = StandardSequence("quad-hard", rig, 0.1);
  EXPECT_FALSE(HasErrors(options.imu_errors));
  EXPECT_EQ(Recording(options).rig().imu.noise.accelerometer_density, 1.1e-3);
  options.faults.imu_vibration = ImuVibration{.acceleration = 0.27, .rate = 0.028};
  const ImuNoise told = Recording(options).rig().imu.noise;
  EXPECT_NEAR(told.accelerometer_density, std::hypot(0.27 / std::sqrt(200.0), 1.1e-3), 1e-12);
  EXPECT_NEAR(told.gyroscope_density, std::hypot(0.028 / std::sqrt(200.0), 2.3e-4), 1e-12);
  EXPECT_EQ(told.gyroscope_random_walk, 8.3e-6);
}

// Nothing of the person jumps, least of all where splines have their knots; and the hips are above
// the ground by the length of the legs, on stairs and in the mine, too.
TEST(Operators, WalkSmoothlyOnTheGround) {
  for (const std::string name : {"quad-hard", "undermine-hard", "stairs"}) {
    const Recording recording(StandardSequence(name, RigOf(*FindSequence(name)), 20.0));
    const int person = static_cast<int>(recording.world().movers().size()) - 1;
    double jump = 0.0, stands = 0.0, n = 0.0;
    for (int step = 1; step < 190; ++step) {
      const Time time = recording.begin() + Duration::FromMilliseconds(100) * step;
      const WorldSnapshot before = recording.world().At(time - Duration::FromNanoseconds(2000)),
                          after = recording.world().At(time + Duration::FromNanoseconds(2000));
      for (int part = 0; part < 10; ++part) {
        const Eigen::Vector3d end(0.0, 0.0, -0.5);
        jump = std::max(
            jump, (before.PoseOf(person, part) * end - after.PoseOf(person, part) * end).norm());
      }
      const Eigen::Vector3d hips = after.PoseOf(person, 0).translation();
      const auto ground = recording.world().Cast(hips, -Eigen::Vector3d::UnitZ(), 3.0);
      ASSERT_TRUE(ground.has_value()) << name << " " << step;
      stands += ground->range, n += 1.0;
    }
    EXPECT_LT(jump, 1e-3) << name;  // 4 us of a fast limb are 0.04 mm
    EXPECT_THAT(stands / n, AllOf(Ge(0.85), Le(1.0))) << name;
  }
}

std::string Identifier(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, Sequences, ::testing::ValuesIn(SequenceCatalogue()),
                         [](const auto& instance) { return Identifier(instance.param.name); });
INSTANTIATE_TEST_SUITE_P(Catalogue, FirstSweeps, ::testing::ValuesIn(Expectations()),
                         [](const auto& instance) { return Identifier(instance.param.sequence); });

// The tables of the paper, sequence by sequence.
TEST(SequenceCatalogue, HoldsEverySequenceOfThePaper) {
  std::set<std::string> names, paper;
  for (const SequenceInfo& info : SequenceCatalogue()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name << " twice";
    if (!info.paper.empty()) paper.insert(info.paper);
    EXPECT_THAT(info.seconds, AllOf(Ge(30.0), Le(120.0))) << info.name;
  }
  EXPECT_THAT(paper, ::testing::UnorderedElementsAre(
                         "Quad-Easy", "Quad-Hard", "Math-Easy", "Math-Medium", "Math-Hard",
                         "Undermine-Hard", "Stairs", "Cloister", "room-01", "room-02", "room-03",
                         "hall-05", "door-02", "gate-03", "walk-01", "Construction Upper Level 3",
                         "Basement 2", "Attic to Upper Gallery 2", "Corridor Lower Gallery 2"));
}

}  // namespace
}  // namespace mlvi

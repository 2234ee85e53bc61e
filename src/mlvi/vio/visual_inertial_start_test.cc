// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/visual_inertial_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mlvi/geometry/so3.h"
#include "mlvi/imu/imu_testing.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/vio/inertial_path.h"
#include "mlvi/vio/testing.h"
#include "mlvi/vio/visual_inertial_alignment.h"

namespace mlvi {
namespace {

using testing::AddImuNoise;
using ::testing::HasSubstr;
using testing::kGravity;
using testing::TestImu;
using testing::Walk;

// Two seconds of a walk seen at 10 Hz, with the biases of an IMU that was not calibrated.
test::SyntheticOptions TwoSeconds(std::uint64_t seed) {
  return {.accelerometer_bias = 0.1,
          .gyroscope_bias = 0.01,
          .budget = 200,
          .set_rate = 10.0,
          .seconds = 2.1,
          .seed = seed};
}

struct Recording {
  explicit Recording(const test::SyntheticOptions& options)
      : synthetic(options), time_offsets(options.time_offsets) {
    for (int set = 0; set < synthetic.sets(); ++set) {
      synthetic.Advance();
      frames.push_back({synthetic.frame(), synthetic.stamp(), synthetic.images().delays});
      truth.push_back(synthetic.Truth());
    }
  }

  // As the odometry has it: no samples behind the last stamp, time offsets known.
  StartData data() const {
    const std::vector<ImuSample>& samples = synthetic.samples();
    const auto behind = [&](const ImuSample& s) { return s.stamp > frames.back().stamp; };
    return {.tracks = synthetic.tracks().tracks(),
            .frames = frames,
            .samples = {samples.begin(), std::find_if(samples.begin(), samples.end(), behind)},
            .T_body_pano = synthetic.model().T_body_pano(),
            .pixel_sigma = 0.5,
            .time_offsets = time_offsets};
  }

  test::SyntheticRecording synthetic;
  std::vector<double> time_offsets;
  std::vector<FrameInstant> frames;
  std::vector<NavState> truth;
};

// Truth in the world that a start defines: levelled, origin and heading of the first body.
NavState TruthInStartWorld(const Recording& recording, std::size_t k) {
  const NavState& first = recording.truth.front();
  const Eigen::Quaterniond level =
      LevelRotation(first.T_world_body.rotation().conjugate() * Eigen::Vector3d::UnitZ());
  const Pose3 T_start_world = Pose3(level, Eigen::Vector3d::Zero()) * first.T_world_body.inverse();
  NavState state = recording.truth[k];
  state.T_world_body = T_start_world * state.T_world_body;
  state.v_world_body = T_start_world.rotation() * state.v_world_body;
  return state;
}

TEST(InertialPathTest, DerivativesAreThoseOfThePath) {
  const Walk walk;
  const std::vector<Time> instants = {Walk::At(0.0), Walk::At(0.4), Walk::At(1.3)};
  const ImuBias linearised{.accelerometer = {0.02, 0.0, -0.03}, .gyroscope = {0.002, 0.001, 0.0}};
  const InertialPath path(instants, walk.Samples(0.0, 1.3, 200.0), linearised, TestImu());
  const InertialUnknowns at{
      .velocity = {1.0, -0.4, 0.2},
      .gravity = {1.0, 2.0, -9.5},
      .bias = {.accelerometer = {0.05, 0.02, 0.0}, .gyroscope = {0.004, 0, 0}}};
  for (std::size_t k = 0; k < path.size(); ++k) {
    const InertialPath::Step step = path.At(k, at);
    for (int i = 0; i < inertial_index::kSize; ++i) {
      constexpr double kStep = 1e-6;
      const InertialDelta d = kStep * InertialDelta::Unit(i);
      const InertialPath::Step more = path.At(k, BoxPlus(at, d)),
                               less = path.At(k, BoxPlus(at, -d));
      const Vector6d pose = (BoxMinus(more.T_first_body, step.T_first_body) -
                             BoxMinus(less.T_first_body, step.T_first_body)) /
                            (2.0 * kStep);
      EXPECT_LT((pose - step.d_pose.col(i)).norm(), 1e-7) << "instant " << k << ", unknown " << i;
      const Eigen::Vector3d velocity = (more.velocity - less.velocity) / (2.0 * kStep);
      EXPECT_LT((velocity - step.d_velocity.col(i)).norm(), 1e-7) << k << ", " << i;
    }
  }
}

TEST(InertialPathTest, DerivativesByDisturbancesAreThoseOfThePath) {
  const Walk walk;
  const std::vector<Time> instants = {Walk::At(0.0), Walk::At(0.4), Walk::At(1.3)};
  const InertialPath path(instants, walk.Samples(0.0, 1.3, 200.0), {}, TestImu());
  const InertialUnknowns at{.velocity = {1.0, -0.4, 0.2}, .gravity = {1.0, 2.0, -9.5}, .bias = {}};
  Disturbance disturbance;
  disturbance << 0.01, -0.02, 0.03, 0.1, 0.0, -0.1, 0.02, 0.05, -0.03;
  const InertialPath::Step step = path.At(2, at, disturbance);
  for (int i = 0; i < kDisturbanceSize; ++i) {
    constexpr double kStep = 1e-6;
    const Disturbance d = kStep * Disturbance::Unit(i);
    const InertialPath::Step more = path.At(2, at, disturbance + d),
                             less = path.At(2, at, disturbance - d);
    const Vector6d pose = BoxMinus(more.T_first_body, less.T_first_body) / (2.0 * kStep);
    EXPECT_LT((pose - step.d_disturbance.col(i)).norm(), 1e-7) << i;
  }
}

// Carried from instant to instant the disturbances have the covariance of the whole way.
TEST(InertialPathTest, DisturbancesAddUpToTheNoiseOfTheWholeWay) {
  const Walk walk;
  std::vector<Time> instants;
  for (int k = 0; k <= 10; ++k) instants.push_back(Walk::At(0.1 * k));
  ImuSpec imu = TestImu();
  imu.noise.accelerometer_random_walk = imu.noise.gyroscope_random_walk = 0.0;
  const std::vector<ImuSample> samples = walk.Samples(0.0, 1.0, 200.0);
  const InertialPath path(instants, samples, {}, imu);
  DisturbanceMatrix covariance = DisturbanceMatrix::Zero();
  for (std::size_t k = 1; k < path.size(); ++k) {
    const InertialPath::Disturbing& step = path.DisturbingBefore(k);
    covariance = step.transition * covariance * step.transition.transpose() + step.covariance;
  }
  const PreintegratedImu whole =
      Preintegrate(SamplesBetween(samples, instants.front(), instants.back()), {}, imu);
  const DisturbanceMatrix expected =
      whole.covariance.topLeftCorner<kDisturbanceSize, kDisturbanceSize>();
  EXPECT_LT((covariance - expected).norm(), 1e-9 * expected.norm());
}

TEST(InertialPathTest, FollowsTheTruth) {
  const Walk walk;
  const std::vector<Time> instants = {Walk::At(0.0), Walk::At(1.0)};
  const InertialPath path(instants, walk.Samples(0.0, 1.0, 1000.0), {}, TestImu());
  const NavState first = walk.State(0.0), last = walk.State(1.0);
  const Eigen::Quaterniond R = first.T_world_body.rotation().conjugate();
  const InertialPath::Step step = path.At(
      1, {.velocity = R * first.v_world_body, .gravity = R * Eigen::Vector3d(0, 0, -kGravity)});
  const Vector6d error =
      BoxMinus(step.T_first_body, first.T_world_body.inverse() * last.T_world_body);
  EXPECT_LT(error.norm(), 1e-4);
  EXPECT_LT((step.velocity - R * last.v_world_body).norm(), 1e-4);
}

// White acceleration and tilt by white rates, integrated as an IMU at rest would see them.
TEST(InertialPathTest, NoiseAloneExcitesAsPredicted) {
  std::vector<Time> instants;
  for (int k = 0; k <= 20; ++k) instants.push_back(Walk::At(0.1 * k));
  ImuSpec imu = TestImu();
  imu.noise.accelerometer_random_walk = imu.noise.gyroscope_random_walk = 0.0;
  RandomStream random(7, "excitation");
  double squared = 0.0, predicted = 0.0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<ImuSample> samples;
    for (int k = 0; k <= 400; ++k) {
      samples.push_back({.stamp = Walk::At(k / 200.0), .linear_acceleration = {0, 0, kGravity}});
    }
    AddImuNoise(imu, {}, random, samples);
    const auto excitation =
        InertialPath(instants, samples, {}, imu).FindExcitation(imu.noise, kGravity);
    squared += excitation.path * excitation.path / kTrials;
    predicted = excitation.noise;
  }
  // Tilt acts on two axes, and is counted on three. Some 20 degrees of freedom per trial: 3 %.
  EXPECT_NEAR(std::sqrt(squared) / predicted, 1.0, 0.1);
}

// Without noise and biases the closed form is exact but for the integration of the IMU's samples.
TEST(AlignTracksTest, IsExactWithoutNoise) {
  for (const int cameras : {1, 4}) {
    test::SyntheticOptions options = TwoSeconds(1);
    options.imu.noise = {};
    options.accelerometer_bias = options.gyroscope_bias = options.pixel_noise = 0.0;
    options.cameras = cameras;
    const Recording recording(options);
    std::vector<internal::FeatureViews> features;
    for (const Track& track : recording.synthetic.tracks().tracks()) {
      internal::FeatureViews views;
      for (const TrackObservation& seen : track.observations) {
        views.push_back({static_cast<std::size_t>(seen.frame.value()), seen.observation});
      }
      if (views.size() >= 2) features.push_back(views);
    }
    std::vector<Time> instants;
    for (const FrameInstant& frame : recording.frames) instants.push_back(frame.stamp);
    const InertialPath path(instants, recording.synthetic.samples(), {}, TestImu());
    const auto alignment =
        internal::AlignTracks({.features = features,
                               .T_body_pano = recording.synthetic.model().T_body_pano(),
                               .pixel_sigma = 0.5},
                              path, {}, kGravity);
    const Eigen::Quaterniond R = recording.truth[0].T_world_body.rotation().conjugate();
    EXPECT_LT((alignment.unknowns.velocity - R * recording.truth[0].v_world_body).norm(), 0.01);
    EXPECT_LT((alignment.unknowns.gravity - R * Eigen::Vector3d(0, 0, -kGravity)).norm(), 0.01);
  }
}

// The IMU of M2DGR's robot (RIGS 2.4): a hundred times the white noise of a good one. Over two
// seconds its rates alone move features by more than a pixel.
ImuNoise NoisyImu() { return {3.77e-2, 2.34e-3, 1.14e-3, 1.44e-5}; }

struct StartCase {
  int cameras = 4;
  ImuNoise noise = TestImu().noise;
  double velocity = 0.02;   // m/s, largest error
  double rotation = 0.005;  // rad
  std::vector<double> time_offsets = {};
};

class MovingStart : public ::testing::TestWithParam<StartCase> {};
INSTANTIATE_TEST_SUITE_P(
    Cameras, MovingStart,
    ::testing::Values(StartCase{.cameras = 1}, StartCase{.cameras = 2}, StartCase{.cameras = 4},
                      StartCase{
                          .cameras = 4, .noise = NoisyImu(), .velocity = 0.15, .rotation = 0.03},
                      StartCase{.time_offsets = std::vector<double>(4, 0.010)},
                      StartCase{.time_offsets = {0.010, -0.012, 0.0, 0.004}}));

TEST_P(MovingStart, FindsVelocityGravityAndBiases) {
  double nees = 0.0;
  constexpr int kSeeds = 20;
  for (int seed = 0; seed < kSeeds; ++seed) {
    test::SyntheticOptions options = TwoSeconds(static_cast<std::uint64_t>(seed));
    options.cameras = GetParam().cameras;
    options.imu.noise = GetParam().noise;
    options.time_offsets = GetParam().time_offsets;
    const Recording recording(options);
    const auto start = InitializeFromTracks(recording.data(), options.imu, kGravity, {});
    ASSERT_TRUE(start.has_value()) << start.error().message;
    ASSERT_EQ(start->states.size(), recording.frames.size());
    EXPECT_EQ(start->method, "visual-inertial");
    const NavState truth = TruthInStartWorld(recording, recording.truth.size() - 1);
    const NavState& last = start->states.back();
    const Vector15d error = BoxMinus(last, truth);
    EXPECT_LT(error.segment<3>(nav_index::kVelocity).norm(), GetParam().velocity);
    EXPECT_LT(error.segment<3>(nav_index::kRotation).norm(), GetParam().rotation);
    EXPECT_NEAR(start->rms_residual, 1.0, 0.05);
    nees += error.dot(start->covariance.ldlt().solve(error)) / kSeeds;
  }
  // 15 expected; 99 % of means of 20 are in between (95 % of six of them).
  EXPECT_GT(nees, 12.0);
  EXPECT_LT(nees, 18.3);
}

// Cameras that run freely, over a whole period of 100 ms.
TEST(VisualInertialStartTest, ImagesOfASetMayBeOfDifferentInstants) {
  for (int seed = 0; seed < 5; ++seed) {
    test::SyntheticOptions options = TwoSeconds(static_cast<std::uint64_t>(seed));
    options.advances = {0.0, 0.03, 0.0001, 0.072};
    const Recording recording(options);
    const auto start = InitializeFromTracks(recording.data(), TestImu(), kGravity, {});
    ASSERT_TRUE(start.has_value()) << start.error().message;
    ASSERT_EQ(start->states.size(), recording.frames.size());
    EXPECT_EQ(start->states.back().stamp, recording.frames.back().stamp);
    const Vector15d error = BoxMinus(start->states.back(), TruthInStartWorld(recording, 20));
    EXPECT_LT(error.segment<3>(nav_index::kVelocity).norm(), 0.02);
    EXPECT_LT(error.segment<3>(nav_index::kRotation).norm(), 0.007);
    // First images of two cameras are before the first frame: their tracks begin with a second one,
    // which has noise, as later ones have.
    EXPECT_NEAR(start->rms_residual, 1.0, 0.1);
  }
}

// Unknown, they are a contradiction.
TEST(VisualInertialStartTest, TimeOffsetsMatter) {
  test::SyntheticOptions options = TwoSeconds(1);
  options.time_offsets.assign(4, 0.010);
  const Recording recording(options);
  EXPECT_TRUE(InitializeFromTracks(recording.data(), TestImu(), kGravity, {}).has_value());
  StartData untold = recording.data();
  untold.time_offsets = {};
  const auto start = InitializeFromTracks(untold, TestImu(), kGravity, {});
  ASSERT_FALSE(start.has_value());
  EXPECT_THAT(start.error().message, HasSubstr("contradict each other"));
}

Walk Still() {
  return {.yaw_rate = 0.0,
          .sway_amplitude = Eigen::Vector3d::Zero(),
          .velocity = Eigen::Vector3d::Zero(),
          .position_amplitude = Eigen::Vector3d::Zero()};
}

TEST(VisualInertialStartTest, RestIsFoundAtRest) {
  test::SyntheticOptions options = TwoSeconds(3);
  options.walk = Still();
  options.accelerometer_bias = 0.02;
  const Recording recording(options);
  const auto start = InitializeFromTracks(recording.data(), TestImu(), kGravity, {});
  ASSERT_TRUE(start.has_value()) << start.error().message;
  EXPECT_EQ(start->method, "static");
  ASSERT_EQ(start->states.size(), recording.frames.size());
  EXPECT_EQ(start->states[3].stamp, recording.frames[3].stamp);
  const NavState truth = TruthInStartWorld(recording, 0);
  // The accelerometer's bias passes for tilt.
  EXPECT_LT(BoxMinus(start->states[0].T_world_body, truth.T_world_body).norm(), 0.01);
  EXPECT_LT((start->states[0].bias.gyroscope - truth.bias.gyroscope).norm(), 0.001);
}

TEST(VisualInertialStartTest, ASteadyDriveIsNoRestAndOneCameraCannotTellItsSpeed) {
  // Without vibration: the IMU alone takes it for rest.
  test::SyntheticOptions options = TwoSeconds(4);
  options.walk = Still();
  options.walk.velocity = {1.5, 0.0, 0.0};
  options.cameras = 1;
  options.accelerometer_bias = 0.02;
  const Recording recording(options);
  ASSERT_TRUE(InitializeAtRest(recording.synthetic.samples(), TestImu(), kGravity).has_value());
  const auto start = InitializeFromTracks(recording.data(), TestImu(), kGravity, {});
  ASSERT_FALSE(start.has_value());
  EXPECT_THAT(start.error().message, HasSubstr("does not show the scale yet"));
}

TEST(VisualInertialStartTest, WrongExtrinsicsContradictTheImu) {
  test::SyntheticOptions options = TwoSeconds(5);
  options.T_nominal_true = Pose3(ExpSo3({0.1, 0.0, 0.0}), Eigen::Vector3d::Zero());
  const Recording recording(options);
  const auto start = InitializeFromTracks(recording.data(), TestImu(), kGravity, {});
  ASSERT_FALSE(start.has_value());
  EXPECT_THAT(start.error().message, HasSubstr("check the extrinsics of cameras and IMU"));
}

TEST(VisualInertialStartTest, SaysWhatIsMissing) {
  const auto message = [](const StartData& data) {
    const auto start = InitializeFromTracks(data, TestImu(), kGravity, {});
    return start.has_value() ? std::string() : start.error().message;
  };
  EXPECT_THAT(message({}), HasSubstr("needs images over 1.0 s"));
  const Recording recording(TwoSeconds(6));
  StartData brief = recording.data();
  brief.frames = brief.frames.first(6);
  EXPECT_THAT(message(brief), HasSubstr("got 0.50 s"));
  StartData sparse = recording.data();
  sparse.tracks = sparse.tracks.first(20);
  EXPECT_THAT(message(sparse), HasSubstr("needs 30 tracks"));
  StartData late = recording.data();
  late.samples = late.samples.subspan(50);
  EXPECT_THAT(message(late), HasSubstr("the IMU does not cover the images"));
}

}  // namespace
}  // namespace mlvi

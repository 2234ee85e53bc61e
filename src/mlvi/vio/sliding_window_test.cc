// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/sliding_window.h"

#include <gtest/gtest.h>

#include "mlvi/base/parallel.h"
#include "mlvi/vio/testing.h"
#include "mlvi/vio/window_features.h"

namespace mlvi {
namespace {

WindowConfig ConfigFor(const test::SyntheticOptions& options) {
  WindowConfig config;
  config.pixel_sigma = options.pixel_noise;
  config.pixel_drift = options.drift;
  return config;
}

TEST(SlidingWindowTest, StaysWithTheTruth) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  ASSERT_EQ(run.estimates.size(), 99U);
  for (std::size_t i = 0; i < run.estimates.size(); ++i) {
    ASSERT_TRUE(run.estimates[i].solved);
    const Vector15d error = BoxMinus(run.truth[i], run.estimates[i].newest.state);
    const Vector15d sigma = run.estimates[i].newest.covariance.diagonal().cwiseSqrt();
    // Robustly within what the window itself claims.
    EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 6.0) << "set " << i;
  }
  // Noise in pixels shows up as it was put in: the anchor's own noise adds up to sqrt 2.
  EXPECT_GT(run.estimates.back().rms_px, 0.8 * options.pixel_noise);
  EXPECT_LT(run.estimates.back().rms_px, 1.42 * options.pixel_noise);
  EXPECT_GT(run.keyframes, 15);
}

struct Errors {
  double nees = 0.0;      // mean of the pose's
  double position = 0.0;  // m, rms at the end
};

Errors RunSeeds(test::SyntheticOptions options, const WindowConfig& config, int seeds,
                const test::BeforeSolving& before_solving = {},
                const test::StartSigmas& sigmas = {}) {
  Errors errors;
  for (int seed = 1; seed <= seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const test::SyntheticRun run = test::RunWindow(options, config, sigmas, before_solving);
    errors.nees += run.LastPoseNees() / seeds;
    errors.position += run.LastError().segment<3>(nav_index::kPosition).squaredNorm() / seeds;
  }
  errors.position = std::sqrt(errors.position);
  return errors;
}

// Errors are as large as the covariance says. 99 % of means of 12 chi-square values of 6 degrees of
// freedom lie within 3.7 and 8.9.
TEST(SlidingWindowTest, IsConsistentUnderWhiteNoise) {
  test::SyntheticOptions options;
  options.seconds = 4.0;
  options.budget = 100;
  options.pixel_noise = 0.1;
  const Errors errors = RunSeeds(options, ConfigFor(options), 12);
  EXPECT_GT(errors.nees, 3.7);
  EXPECT_LT(errors.nees, 8.9);
}

// Tracks that slip off have errors that add up from set to set, which is modelled as a variance
// that grows, without the correlation in time. That costs some of the consistency, but not all of
// it.
TEST(SlidingWindowTest, IsNearlyConsistentWithSlippingTracks) {
  test::SyntheticOptions options;
  options.seconds = 4.0;
  options.budget = 100;
  options.pixel_noise = 0.1;
  options.drift = 0.15;
  WindowConfig config = ConfigFor(options);
  config.pixel_sigma = 0.3;
  const Errors errors = RunSeeds(options, config, 10);
  // Nor is the covariance inflated: 99.5 % of means of ten under a right one are above.
  EXPECT_GT(errors.nees, 3.5);
  EXPECT_LT(errors.nees, 12.0);
}

// One camera, a noisy IMU (M2DGR's) and a slow, even drive show hardly any scale: the speed stays as
// uncertain as it is, and as wrong as that, while frames leave the window.
TEST(SlidingWindowTest, KnowsThatScaleIsNotKnown) {
  test::SyntheticOptions options;
  options.seconds = 8.0;
  options.set_rate = 10.0;
  options.cameras = 1;
  options.budget = 100;
  options.pixel_noise = 0.1;
  options.imu.noise = {3.77e-2, 2.34e-3, 1.14e-3, 1.44e-5};
  options.walk.yaw_rate = 0.05;
  options.walk.sway_amplitude.setZero();
  options.walk.velocity = {0.7, 0.0, 0.0};
  options.walk.position_amplitude.setZero();
  constexpr int kSeeds = 6;
  double squares = 0.0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const test::SyntheticRun run =
        test::RunWindow(options, ConfigFor(options), {.velocity = 0.035});
    const NavState& truth = run.truth.back();
    const Eigen::Vector3d ahead = truth.v_world_body.normalized();
    const double error = ahead.dot(run.LastError().segment<3>(nav_index::kVelocity));
    const double variance = ahead.dot(run.estimates.back().newest.covariance.block<3, 3>(
                                          nav_index::kVelocity, nav_index::kVelocity) *
                                      ahead);
    squares += error * error / variance / kSeeds;
  }
  // 99 % of means of six squares of one degree of freedom.
  EXPECT_GT(squares, 0.11);
  EXPECT_LT(squares, 3.1);
}

TEST(SlidingWindowTest, LidarDepthKeepsTheScale) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  options.budget = 100;
  const auto measure = [](test::SyntheticRecording& recording, SlidingWindow& window) {
    for (WindowFeature& feature : window.window().features) {
      if (feature.lidar || feature.observations.back().frame != recording.frame()) continue;
      RandomStream random(static_cast<std::uint64_t>(feature.track.value()), "lidar");
      const double depth = recording.TrueDepth(feature.track) + 0.03 * random.Normal();
      SetLidarDepth(feature, depth, 0.03, window.window(), window.config());
    }
  };
  // An error of the first heading turns the whole path, with and without LiDAR.
  const test::StartSigmas sigmas{.rotation = 1e-4};
  const Errors without = RunSeeds(options, ConfigFor(options), 4, {}, sigmas);
  const Errors with = RunSeeds(options, ConfigFor(options), 4, measure, sigmas);
  EXPECT_LT(with.position, 0.7 * without.position);
}

// With the noise that tracks really have: at 0.5 px the window itself claims no more than 6 mm.
TEST(SlidingWindowTest, FindsThePlaceOfEveryCamera) {
  test::SyntheticOptions options;
  options.seconds = 10.0;
  options.pixel_noise = 0.1;
  const Eigen::Vector3d turn = M_PI / 180.0 * Eigen::Vector3d(0.6, -0.5, 0.62);  // 1 degree
  options.T_nominal_true = Pose3(ExpSo3(turn), {0.006, -0.005, 0.0062});         // 1 cm
  WindowConfig config = ConfigFor(options);
  config.extrinsics_translation_sigma = 0.01;
  const test::SyntheticRun run = test::RunWindow(options, config);
  const test::SyntheticRecording nominal(options);
  for (int i = 0; i < options.cameras; ++i) {
    const Pose3 truth = nominal.model().T_pano_camera(i) * options.T_nominal_true;
    const Vector6d error =
        BoxMinus(run.calibration.T_pano_camera[static_cast<std::size_t>(i)], truth);
    EXPECT_LT(error.head<3>().norm(), 0.003) << "camera " << i;
    EXPECT_LT(error.tail<3>().norm(), 0.1 * M_PI / 180.0) << "camera " << i;
  }
}

TEST(SlidingWindowTest, FindsTheTimeOffsetThatAllCamerasShare) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  options.time_offsets.assign(4, 0.010);
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  for (const double offset : run.calibration.time_offsets) EXPECT_NEAR(offset, 0.010, 0.001);
}

// One clock is off, the others are right: it alone is corrected.
TEST(SlidingWindowTest, FindsTheTimeOffsetOfOneCamera) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  options.time_offsets = {0.0, -0.010, 0.0, 0.0};
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  for (std::size_t c = 0; c < 4; ++c) {
    const CalibrationDeviation::TimeOffset& d = run.estimates.back().deviation.time_offsets[c];
    EXPECT_EQ(d.seconds, run.calibration.time_offsets[c]);
    EXPECT_NEAR(d.seconds, options.time_offsets[c], 0.001) << "camera " << c;
    EXPECT_LT(std::abs(d.seconds - options.time_offsets[c]), 5.0 * d.sigma) << "camera " << c;
  }
}

// Cameras that run freely, over a period of 50 ms, are as good as those that are triggered together.
TEST(SlidingWindowTest, CamerasMayTakeTheirImagesAtDifferentTimes) {
  test::SyntheticOptions options;
  options.seconds = 4.0;
  options.budget = 100;
  options.pixel_noise = 0.3;
  const Errors together = RunSeeds(options, ConfigFor(options), 6);
  options.advances = {0.0, 0.037, 0.0124, 0.025};
  const Errors freely = RunSeeds(options, ConfigFor(options), 6);
  EXPECT_LT(freely.position, 1.2 * together.position);
}

// A round that is not believed (no Slide) leaves no calibration behind.
TEST(SlidingWindowTest, ForgetsTheCalibrationOfARoundThatFailed) {
  test::SyntheticOptions options;
  options.time_offsets.assign(4, 0.010);
  test::SyntheticRecording recording(options);
  SlidingWindow window(ConfigFor(options), {}, recording.rig().imu, recording.rig().gravity,
                       recording.NominalCalibration());
  recording.Advance();
  window.Start(recording.images(), recording.DisturbedTruth({}), recording.samples(),
               recording.tracks());
  std::vector<double> believed;
  for (int set = 1; set < 30; ++set) {
    believed = window.window().calibration.time_offsets;
    recording.Advance();
    window.Add(recording.images(), recording.samples(), recording.tracks());
    window.Solve();
    if (set + 1 < 30) window.Slide();
  }
  ASSERT_NE(believed, std::vector<double>(4, 0.0));
  ASSERT_NE(window.window().calibration.time_offsets, believed);
  window.Clear();
  EXPECT_EQ(window.window().calibration.time_offsets, believed);
}

// What a window knew of the calibration is known, by half, to the one that begins after its failure;
// the rig file counts once, however often that happens.
TEST(SlidingWindowTest, KeepsWhatItKnewOfTheCalibration) {
  test::SyntheticOptions options;
  options.time_offsets.assign(4, 0.010);
  test::SyntheticRecording recording(options);
  SlidingWindow window(ConfigFor(options), {}, recording.rig().imu, recording.rig().gravity,
                       recording.NominalCalibration());
  const auto restart = [&] {
    recording.Advance();
    window.Start(recording.images(), recording.DisturbedTruth({}), recording.samples(),
                 recording.tracks());
  };
  const auto run = [&](int sets) {
    WindowEstimate estimate;
    for (int set = 0; set < sets; ++set) {
      recording.Advance();
      window.Add(recording.images(), recording.samples(), recording.tracks());
      estimate = window.Solve();
      window.Slide();
    }
    return estimate.deviation;
  };
  restart();
  const CalibrationDeviation first = run(2), known = run(70);
  restart();
  const CalibrationDeviation again = run(2);
  for (std::size_t c = 0; c < 4; ++c) {
    const double before = known.time_offsets[c].sigma, after = again.time_offsets[c].sigma;
    ASSERT_LT(before, 0.4 * first.time_offsets[c].sigma);
    EXPECT_LT(after, 2.5 * before);
    EXPECT_GT(after, before);
    EXPECT_NEAR(again.time_offsets[c].seconds, known.time_offsets[c].seconds, 4.0 * before);
  }
  // Starts alone add nothing.
  for (int i = 0; i < 5; ++i) {
    restart();
    run(1);
  }
  restart();
  EXPECT_GT(run(1).cameras[0].rotation_sigma, known.cameras[0].rotation_sigma);
}

// Standing still tells nothing about the calibration: it stays where the rig file has it.
TEST(SlidingWindowTest, LeavesTheCalibrationAloneAtRest) {
  test::SyntheticOptions options;
  options.seconds = 5.0;
  options.walk.yaw_rate = 0.0;
  options.walk.sway_amplitude.setZero();
  options.walk.velocity.setZero();
  options.walk.position_amplitude.setZero();
  const WindowConfig config = ConfigFor(options);
  const test::SyntheticRun run = test::RunWindow(options, config);
  const test::SyntheticRecording nominal(options);
  for (const double offset : run.calibration.time_offsets) {
    EXPECT_NEAR(offset, 0.0, config.time_offset_sigma);
  }
  for (int i = 0; i < options.cameras; ++i) {
    const Vector6d error = BoxMinus(run.calibration.T_pano_camera[static_cast<std::size_t>(i)],
                                    nominal.model().T_pano_camera(i));
    EXPECT_LT(error.tail<3>().norm(), config.extrinsics_rotation_sigma) << "camera " << i;
    EXPECT_LT(error.head<3>().norm(), config.extrinsics_translation_sigma) << "camera " << i;
  }
  EXPECT_LT(run.LastError().segment<3>(nav_index::kPosition).norm(), 0.1);
}

TEST(SlidingWindowTest, HasTheSameBitsAtAnyNumberOfThreads) {
  test::SyntheticOptions options;
  options.seconds = 2.0;
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return test::RunWindow(options, ConfigFor(options));
  };
  const test::SyntheticRun one = run(1), two = run(2);
  ASSERT_EQ(one.estimates.size(), two.estimates.size());
  for (std::size_t i = 0; i < one.estimates.size(); ++i) {
    const OdometryEstimate &a = one.estimates[i].newest, &b = two.estimates[i].newest;
    ASSERT_EQ(a.state.T_world_body.matrix(), b.state.T_world_body.matrix()) << "set " << i;
    ASSERT_EQ(a.covariance, b.covariance) << "set " << i;
  }
}

// Relative motion is much better known than either pose, and as well as it says.
TEST(SlidingWindowTest, MotionHasItsOwnCovariance) {
  test::SyntheticOptions options;
  options.seconds = 4.0;
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  double nees = 0.0;
  int count = 0;
  for (std::size_t i = 20; i < run.estimates.size(); ++i) {
    const auto& motion = run.estimates[i].motion;
    ASSERT_TRUE(motion.has_value());
    EXPECT_EQ(motion->from, run.truth[i - 1].stamp);
    const Pose3 truth = run.truth[i - 1].T_world_body.inverse() * run.truth[i].T_world_body;
    const Vector6d error = BoxMinus(truth, motion->T_from_to);
    nees += error.dot(motion->covariance.llt().solve(error));
    ++count;
  }
  // Errors of neighbouring motions are correlated: a wide band.
  EXPECT_GT(nees / count, 2.0);
  EXPECT_LT(nees / count, 15.0);
}

TEST(KeyframePolicyTest, RotationAloneIsNoNovelty) {
  test::SyntheticOptions options;
  options.seconds = 2.0;
  options.offset = 0.0;
  options.walk.velocity.setZero();
  options.walk.position_amplitude.setZero();
  options.walk.sway_amplitude *= 0.2;  // tracks stay in view
  options.walk.yaw_rate = 0.1;
  const test::SyntheticRun run = test::RunWindow(options, ConfigFor(options));
  EXPECT_LE(run.keyframes, 3);
}

}  // namespace
}  // namespace mlvi

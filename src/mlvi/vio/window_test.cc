// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "mlvi/base/parallel.h"
#include "mlvi/factors/imu_factor.h"
#include "mlvi/solver/ceres_problem.h"
#include "mlvi/vio/bearing_factor.h"
#include "mlvi/vio/testing.h"
#include "mlvi/vio/window_features.h"
#include "mlvi/vio/window_marginalization.h"

namespace mlvi {
namespace {

using testing::kGravity;

// A window that has run for `sets` sets of images.
struct Scene {
  Scene(const WindowConfig& window_config, int sets, std::vector<double> advances = {})
      : config(window_config),
        recording([&] {
          test::SyntheticOptions options;
          options.budget = 60;
          options.advances = std::move(advances);
          return options;
        }()),
        window(config, {}, recording.rig().imu, kGravity, recording.NominalCalibration()) {
    recording.Advance();
    window.Start(recording.images(), recording.DisturbedTruth({}), recording.samples(),
                 recording.tracks());
    for (int i = 1; i < sets; ++i) {
      recording.Advance();
      window.Add(recording.images(), recording.samples(), recording.tracks());
      if (i + 1 == sets) break;  // the last one is left to the test
      window.Solve();
      window.Slide();
    }
  }

  WindowConfig config;
  test::SyntheticRecording recording;
  SlidingWindow window;
};

// Everything that the objective depends on, moved along one coordinate: those of the layout, then
// inverse depths.
double CostAlong(const VioWindow& window, const WindowConfig& config, int coordinate, double step) {
  VioWindow moved = window;
  const WindowLayout layout = window.Layout(config);
  if (coordinate < layout.size()) {
    MoveWindow(moved, layout, step * Eigen::VectorXd::Unit(layout.size(), coordinate));
  } else {
    moved.features[static_cast<std::size_t>(coordinate - layout.size())].inverse_depth += step;
  }
  return Linearize(moved, config, kGravity).cost;
}

class WindowGradient : public ::testing::TestWithParam<Compensation> {};

// b is minus the gradient of the objective in every coordinate: poses, velocities, biases,
// extrinsics and time offsets of every camera, inverse depths; bearings, LiDAR, IMU and prior together.
TEST_P(WindowGradient, AgreesWithDifferencesOfTheObjective) {
  WindowConfig config;
  config.compensation = GetParam();
  config.extrinsics = ExtrinsicsCalibration::kCameras;
  config.time_offset = true;
  Scene scene(config, 5, {0.0, 0.01, 0.02, 0.033});
  VioWindow& window = scene.window.window();
  // The prior takes its calibration's chart where it was made.
  window.calibration = window.prior.calibration;
  window.calibration.time_offsets = {0.004, 0.0032, -0.007, 0.0045};
  // The rig file is within its sigmas for one camera and plainly wrong for the other.
  Vector6d small, large;
  small << 0.001, -0.0005, 0.0008, 0.0003, 0.0006, -0.0004;
  large << 0.02, 0.01, -0.01, 0.01, -0.02, 0.015;
  window.nominal = window.calibration;
  window.nominal.time_offsets.assign(4, 0.0);
  window.nominal.T_pano_camera[0] = BoxPlus(window.nominal.T_pano_camera[0], small);
  window.nominal.T_pano_camera[1] = BoxPlus(window.nominal.T_pano_camera[1], large);
  for (std::size_t f = 0; f < window.features.size(); f += 3) {
    window.features[f].lidar = {1.1 * window.features[f].inverse_depth, 0.05};
  }
  // The prior was made elsewhere.
  for (WindowFrame& frame : window.frames) {
    if (frame.prior_state) frame.prior_state = MoveState(frame.state, 0.01 * Vector15d::Ones());
  }
  const LinearizedWindow system = Linearize(window, config, kGravity);
  const int size = system.layout.size();
  for (int i = 0; i < size + static_cast<int>(window.features.size()); ++i) {
    const double information = i < size ? system.H(i, i) : system.feature_information[i - size];
    if (information == 0.0) continue;
    const double step = 1e-3 / std::sqrt(information);  // a thousandth of a sigma
    const double expected =
        -(8.0 * (CostAlong(window, config, i, step) - CostAlong(window, config, i, -step)) -
          (CostAlong(window, config, i, 2.0 * step) - CostAlong(window, config, i, -2.0 * step))) /
        (12.0 * step);
    const double b = i < size ? system.b[i] : system.feature_gradient[i - size];
    // Differences of an objective of some hundreds lose ten digits of sixteen.
    EXPECT_NEAR(b / std::sqrt(information), expected / std::sqrt(information),
                2e-5 * (1.0 + std::abs(b) / std::sqrt(information)))
        << "coordinate " << i << " of " << size;
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, WindowGradient,
                         ::testing::Values(Compensation::kNone, Compensation::kPlane,
                                           Compensation::kRay));

// Residuals are told per axis that they have, in px and in sigmas: the noise that was put in, in all
// modes; `plane` has one axis.
TEST(BearingStatistics, ArePerAxisInEveryMode) {
  for (const Compensation mode : {Compensation::kRay, Compensation::kPlane}) {
    WindowConfig config;
    config.compensation = mode;
    config.pixel_sigma = 0.5;
    config.pixel_drift = 0.0;
    Scene scene(config, 40);
    const WindowEstimate estimate = scene.window.Solve();
    EXPECT_GT(estimate.rms_px, 0.8 * 0.5);
    EXPECT_LT(estimate.rms_px, 1.42 * 0.5);
    const std::vector<double> errors = FeatureErrors(scene.window.window(), config);
    double sum = 0.0;
    int count = 0;
    for (const double error : errors) {
      sum += error;
      count += error > 0.0 ? 1 : 0;
    }
    EXPECT_GT(sum / count, 0.6);
    EXPECT_LT(sum / count, 2.0);
  }
}

// The same window as a ceres::Problem over the factors: another linearisation, another elimination.
struct BatchWindow {
  explicit BatchWindow(const VioWindow& window, const WindowConfig& config) {
    for (const WindowFrame& f : window.frames) {
      std::array<double, 16> block{};
      StorePose(f.state.T_world_body, block.data());
      Eigen::Map<Eigen::Vector3d>(block.data() + 7) = f.state.v_world_body;
      Eigen::Map<Eigen::Vector3d>(block.data() + 10) = f.state.bias.accelerometer;
      Eigen::Map<Eigen::Vector3d>(block.data() + 13) = f.state.bias.gyroscope;
      states.push_back(block);
    }
    StorePose(window.calibration.T_body_pano, body_pano.data());
    for (const Pose3& T : window.calibration.T_pano_camera)
      StorePose(T, cameras.emplace_back().data());
    for (const WindowFeature& f : window.features) depths.push_back(f.inverse_depth);
    const auto manifold = std::make_shared<PoseManifold>();
    for (auto& s : states) {
      AddParameterBlock(manifold, s.data(), problem);
      problem.AddParameterBlock(s.data() + 7, 3);
      problem.AddParameterBlock(s.data() + 10, 6);
    }
    for (std::size_t i = 1; i < states.size(); ++i) {
      double *a = states[i - 1].data(), *b = states[i].data();
      problem.AddResidualBlock(new ImuFactor(window.frames[i].imu->motion, kGravity), nullptr, a,
                               a + 7, a + 10, b, b + 7, b + 10);
    }
    for (std::size_t f = 0; f < depths.size(); ++f) AddBearings(window, config, f);
    for (double* block : {states[0].data(), states[0].data() + 7, states[0].data() + 10}) {
      problem.SetParameterBlockConstant(block);
    }
  }

  static const ImageMotion& ImageOf(const VioWindow& window, const WindowObservation& o) {
    return window.frames[static_cast<std::size_t>(window.FindFrame(o.frame))]
        .images[static_cast<std::size_t>(o.observation.camera)];
  }

  void AddBearings(const VioWindow& window, const WindowConfig& config, std::size_t f) {
    const auto& all = window.features[f].observations;
    for (std::size_t k = 1; k < all.size(); ++k) {
      const PanoramicObservation &anchor = all[0].observation, &target = all[k].observation;
      const double sigma = std::sqrt(BearingVariance(all[0], all[k], config));
      auto* factor = new BearingFactor({.anchor = anchor,
                                        .target = target,
                                        .anchor_image = ImageOf(window, all[0]),
                                        .target_image = ImageOf(window, all[k]),
                                        .mode = config.compensation,
                                        .radius = window.calibration.radius,
                                        .pixel_sigma = sigma});
      double* a = states[static_cast<std::size_t>(window.FindFrame(all[0].frame))].data();
      double* t = states[static_cast<std::size_t>(window.FindFrame(all[k].frame))].data();
      double* camera = cameras[static_cast<std::size_t>(anchor.camera)].data();
      problem.AddResidualBlock(factor, new ceres::CauchyLoss(config.loss_scale), a, t,
                               body_pano.data(), camera, &depths[f],
                               &time_offsets[static_cast<std::size_t>(anchor.camera)]);
      problem.SetParameterBlockConstant(body_pano.data());
      problem.SetParameterBlockConstant(camera);
      problem.SetParameterBlockConstant(&time_offsets[static_cast<std::size_t>(anchor.camera)]);
    }
  }

  ceres::Problem problem;
  std::vector<std::array<double, 16>> states;
  std::array<double, 7> body_pano{};
  std::vector<std::array<double, 7>> cameras;
  std::vector<double> depths;
  std::array<double, 4> time_offsets{};
};

TEST(WindowSolverTest, FindsTheOptimumThatCeresFinds) {
  WindowConfig config;
  config.max_iterations = 50;
  config.min_decrease = 1e-12;
  config.keyframes = 20;  // nothing is marginalised
  config.extrinsics = ExtrinsicsCalibration::kOff;
  config.time_offset = false;
  Scene scene(config, 30, {0.02, 0.0, 0.0, 0.01});
  VioWindow& window = scene.window.window();
  std::erase_if(window.features, [](const WindowFeature& f) {
    return !f.triangulated || f.observations.size() < 5;
  });
  // The first frame is held, as Ceres holds it.
  VioWindow first = window;
  first.frames.resize(1);
  window.frames.front().prior_state = window.frames.front().state;
  window.prior = FirstPrior(first, 1e-16 * Matrix15d::Identity());
  BatchWindow batch(window, config);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.gradient_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &batch.problem, &summary);
  const WindowSolution solution = SolveWindow(window, config, kGravity);
  ASSERT_TRUE(solution.solved);
  EXPECT_NEAR(solution.final_cost, summary.final_cost, 1e-6 * summary.final_cost);
  const Pose3& pose = window.frames.back().state.T_world_body;
  const Vector6d difference = BoxMinus(LoadPose(batch.states.back().data()), pose);
  EXPECT_LT(difference.head<3>().norm(), 1e-5) << difference.transpose();
  EXPECT_LT(difference.tail<3>().norm(), 1e-6);
}

// Residuals and information are those of the window as it is left, also where the last step was a
// large one: they are what a fresh linearisation there has.
TEST(WindowSolverTest, TellsOfTheWindowThatItLeaves) {
  for (const int iterations : {1, 4}) {
    WindowConfig config;
    Scene scene(config, 12);
    config.max_iterations = iterations;
    VioWindow& window = scene.window.window();
    for (WindowFeature& feature : window.features) feature.inverse_depth *= 1.3;
    const LinearizedWindow before = Linearize(window, config, kGravity);
    const WindowSolution solution = SolveWindow(window, config, kGravity);
    ASSERT_TRUE(solution.solved);
    EXPECT_EQ(solution.iterations, iterations);
    EXPECT_EQ(solution.initial_cost, before.cost);
    const LinearizedWindow after = Linearize(window, config, kGravity);
    ASSERT_LT(after.cost, 0.9 * before.cost);
    EXPECT_EQ(solution.final_cost, after.cost);
    EXPECT_EQ(solution.information.H, EliminateFeatures(after).H);
    ASSERT_EQ(solution.per_camera.size(), after.per_camera.size());
    for (std::size_t c = 0; c < after.per_camera.size(); ++c) {
      EXPECT_EQ(solution.per_camera[c].sum, after.per_camera[c].sum);
      EXPECT_EQ(solution.per_camera[c].freedom, after.per_camera[c].freedom);
    }
  }
}

// Without its first frame a linearised problem has the same solution and the same covariance.
TEST(MarginalizationTest, PriorIsTheSchurComplement) {
  WindowConfig config;
  config.time_offset = true;
  Scene scene(config, 8);
  VioWindow window = scene.window.window();
  const LinearizedWindow system = Linearize(window, config, kGravity);
  const ReducedSystem reduced = EliminateFeatures(system);
  const auto columns = InverseColumns(reduced.H, 0, static_cast<int>(reduced.H.rows()));
  ASSERT_TRUE(columns);
  const Eigen::VectorXd step = *columns * reduced.b;
  const WindowPrior prior = PriorWithoutFirstFrame(window, system);
  const Eigen::MatrixXd information = prior.sqrt_information.transpose() * prior.sqrt_information;
  const auto covariance = InverseColumns(information, 0, static_cast<int>(information.rows()));
  ASSERT_TRUE(covariance);
  // The minimum of the prior, as steps from the present states.
  const Eigen::VectorXd minimum =
      -*covariance * (prior.sqrt_information.transpose() * prior.residual);
  int row = 0;
  for (const WindowPrior::Block& block : prior.blocks) {
    const int index = block.frame.valid() ? window.FindFrame(block.frame) : 0;
    const int start =
        (block.frame.valid() ? system.layout.frame(index) : system.layout.calibration()) +
        block.first;
    for (int k = 0; k < block.size; ++k, ++row) {
      const double sigma = std::sqrt((*columns)(start + k, start + k));
      EXPECT_NEAR(minimum[row], step[start + k], 1e-5 * sigma);
      EXPECT_NEAR((*covariance)(row, row), sigma * sigma, 1e-5 * sigma * sigma);
    }
  }
  EXPECT_EQ(row, information.rows());
}

// What the rig file says is a factor of its own and must not count again in the prior: without
// bearings the prior knows nothing of the calibration.
TEST(MarginalizationTest, LeavesTheRigFileOutOfThePrior) {
  WindowConfig config;
  Scene scene(config, 8);
  VioWindow window = scene.window.window();
  ASSERT_GE(window.frames.size(), 3U);
  window.features.clear();
  // The first state is known, or its marginal would be nothing.
  VioWindow first = window;
  first.frames.resize(1);
  window.frames.front().prior_state = window.frames.front().state;
  window.prior = FirstPrior(first, 1e-4 * Matrix15d::Identity());
  MarginalizeFirstFrame(window, config, kGravity);
  ASSERT_FALSE(window.prior.blocks.back().frame.valid());
  const int size = window.prior.blocks.back().size;
  EXPECT_EQ(size, 7 * static_cast<int>(window.calibration.T_pano_camera.size()));
  EXPECT_EQ(window.prior.sqrt_information.rightCols(size).norm(), 0.0);
}

// Directions that nothing is known about leave without a trace, and without ending the program.
TEST(MarginalizationTest, BearsAFrameThatIsNotDetermined) {
  WindowConfig config;
  Scene scene(config, 8);
  VioWindow window = scene.window.window();
  window.prior = {};
  for (WindowFrame& frame : window.frames) frame.rest_sigma = 0.0;
  MarginalizeFirstFrame(window, config, kGravity);
  EXPECT_TRUE(window.prior.sqrt_information.allFinite());
  EXPECT_TRUE(window.prior.residual.allFinite());
}

// What leaves the window may take information along but never adds any.
TEST(MarginalizationTest, NeverGainsInformation) {
  WindowConfig config;
  config.keyframes = 6;
  config.max_relative_depth_sigma = 10.0;
  Scene scene(config, 40);
  scene.window.Solve();
  VioWindow window = scene.window.window();
  ASSERT_GE(window.frames.size(), 6U);
  // Features that go with the first frame as a whole; others are anchored anew, and an anchor is
  // exact by the model of bearings.
  for (WindowFeature& feature : window.features) feature.alive = false;
  std::erase_if(window.features, [&](const WindowFeature& f) {
    return f.observations.front().frame == window.frames.front().id && f.observations.size() < 5;
  });
  const auto newest = [&](const VioWindow& w) {
    const ReducedSystem system = EliminateFeatures(Linearize(w, config, kGravity));
    const int start = w.Layout(config).frame(static_cast<int>(w.frames.size()) - 1);
    return InverseColumns(system.H, start, 15)->middleRows<15>(start).eval();
  };
  const Eigen::MatrixXd before = newest(window);
  MarginalizeFirstFrame(window, config, kGravity);
  const Eigen::MatrixXd after = newest(window);
  const Eigen::VectorXd scale = before.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd gain = scale.asDiagonal() * (after - before) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(0.5 * (gain + gain.transpose()));
  EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-5);
  // ... and little is lost.
  EXPECT_LT(eigen.eigenvalues().maxCoeff(), 1.0);
}

// Of features that are thrown out, only those whose track lives are told: others may have been
// forgotten by the tracker, as in a window of a rig that stands for long.
// A track on trial is not counted; when it is trusted, all that it saw in frames of the window is,
// once.
TEST(WindowFeaturesTest, TrustedTracksBringWhatTheySawBefore) {
  VioWindow window;
  TrackStore tracks;
  PanoramicObservation seen;
  seen.camera = 0;
  const TrackId known = tracks.Start(FrameId(1), seen);
  const TrackId young = tracks.Start(FrameId(1), seen, /*on_trial=*/true);
  for (int frame = 1; frame <= 5; ++frame) {
    if (frame == 2) {
      window.frames.erase(window.frames.begin());  // 1 has left
    }
    window.frames.push_back({.id = FrameId(frame)});
    if (frame > 1) {
      tracks.Extend(known, FrameId(frame), seen);
      tracks.Extend(young, FrameId(frame), seen);
    }
    if (frame == 4) tracks.Trust(young, FrameId(frame));
    AddObservations(window, FrameId(frame), tracks);
    EXPECT_EQ(window.features.size(), frame < 4 ? 1U : 2U);
  }
  ASSERT_EQ(window.features.size(), 2U);
  EXPECT_EQ(window.features[0].track, known);
  EXPECT_EQ(window.features[0].observations.size(), 5U);
  EXPECT_EQ(window.features[1].track, young);
  std::vector<FrameId> frames;
  for (const WindowObservation& o : window.features[1].observations) frames.push_back(o.frame);
  EXPECT_EQ(frames, (std::vector<FrameId>{FrameId(2), FrameId(3), FrameId(4), FrameId(5)}));
}

TEST(WindowFeaturesTest, OutliersGoAndTheirLivingTracksAreTold) {
  WindowConfig config;
  Scene scene(config, 12);
  VioWindow& window = scene.window.window();
  const std::size_t before = window.features.size();
  std::vector<TrackId> living;
  int spoilt = 0;
  for (WindowFeature& feature : window.features) {
    if (feature.observations.size() < 4 || spoilt == 6) continue;
    // Far off in what is seen of it, every second one in a track that has ended.
    for (std::size_t k = 1; k < feature.observations.size(); ++k) {
      Eigen::Vector3d& bearing = feature.observations[k].observation.bearing_camera;
      bearing = ExpSo3({0.5, 0.5, 0.5}) * bearing;
    }
    feature.alive = ++spoilt % 2 == 0;
    if (feature.alive) living.push_back(feature.track);
  }
  ASSERT_EQ(spoilt, 6);
  EXPECT_EQ(RemoveOutliers(window, config), living);
  EXPECT_EQ(window.features.size(), before - 6);
}

TEST(WindowFeaturesTest, AnchoringElsewhereKeepsThePoint) {
  WindowConfig config;
  Scene scene(config, 12);
  const VioWindow& window = scene.window.window();
  int checked = 0;
  for (WindowFeature feature : window.features) {
    if (feature.observations.size() < 3 ||
        feature.observations[1].frame == feature.observations[0].frame)
      continue;
    const double there = InverseDepthAt(feature, 2, window, config);
    AnchorAt(feature, 1, window, config);
    EXPECT_NEAR(InverseDepthAt(feature, 1, window, config), there, 0.02 * there);
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

}  // namespace
}  // namespace mlvi

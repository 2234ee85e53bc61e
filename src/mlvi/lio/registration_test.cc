// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/registration.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "mlvi/base/parallel.h"
#include "mlvi/lio/testing.h"

namespace mlvi {
namespace {

constexpr Time kBegin = Time::FromNanoseconds(1'700'000'000'000'000'000);

// A sensor standing still at `T`, as a motion.
struct Still {
  Pose3 T;
  Pose3 At(double) const { return T; }
};

class RegistrationTest : public ::testing::Test {
 protected:
  SweepFeatures Features(const test::BoxWorld& world, const Pose3& T, std::uint64_t seed) const {
    const LidarSweep sweep =
        test::Scan(world, Still{T}, *rig_.lidar, 0.0, kBegin, RandomStream(seed));
    NavState state;
    state.stamp = kBegin;
    return ExtractFeatures(Deskew(sweep, std::vector<NavState>{state}, *rig_.lidar), sweep,
                           *rig_.lidar, config_);
  }
  // With the marks along `axis` (world).
  SweepFeatures WithMarks(const test::BoxWorld& world, const Pose3& T, const Eigen::Vector3d& axis,
                          std::uint64_t seed) const {
    const LidarSweep sweep = test::Scan(world, Still{T}, *rig_.lidar, 0.0, kBegin,
                                        RandomStream(seed), {.rings = 96, .columns = 1200});
    NavState state;
    state.stamp = kBegin;
    const DeskewedSweep deskewed = Deskew(sweep, std::vector<NavState>{state}, *rig_.lidar);
    SweepFeatures features = ExtractFeatures(deskewed, sweep, *rig_.lidar, config_);
    features.marks =
        ExtractMarks(deskewed, T.rotation().conjugate() * axis, *rig_.lidar, config_.marks);
    return features;
  }
  // A map of sweeps from several places.
  LocalMap MapOf(const test::BoxWorld& world, std::uint64_t seed) const {
    LocalMap map(config_.map);
    for (int i = 0; i < 5; ++i) {
      const Pose3 T(ExpSo3(Eigen::Vector3d(0.0, 0.1 * i, 0.5 * i)),
                    Eigen::Vector3d(0.3 * i - 0.6, 0.1 * i, 0.0));
      map.Insert(Features(world, T, seed * 100 + i), T);
    }
    return map;
  }
  static StateEstimate Prior(const Pose3& T, double sigma_m, double sigma_rad) {
    StateEstimate prior;
    prior.mean.nav.stamp = kBegin;
    prior.mean.nav.T_world_body = T;
    prior.covariance.diagonal().segment<3>(nav_index::kPosition).setConstant(sigma_m * sigma_m);
    prior.covariance.diagonal().segment<3>(nav_index::kRotation).setConstant(sigma_rad * sigma_rad);
    return prior;
  }
  RegistrationResult Run(const SweepFeatures& features, const LocalMap& map,
                         const StateEstimate& prior) const {
    return Register(features, map, prior, *rig_.lidar, {}, config_.registration,
                    config_.degeneracy);
  }

  Rig rig_ = test::MakeTestRig();
  LioConfig config_;
  const Pose3 truth_{ExpSo3(Eigen::Vector3d(0.05, -0.1, 0.7)), {0.4, -0.3, 0.1}};
};

TEST_F(RegistrationTest, FindsThePoseFromAWrongPredictionInBothVariants) {
  for (const LioVariant variant : {LioVariant::kDensePlane, LioVariant::kEdgePlane}) {
    config_.variant = variant;
    const LocalMap map = MapOf(test::FurnishedRoom(), 1);
    const Vector6d offset = (Vector6d() << 0.15, -0.1, 0.1, 0.03, -0.03, 0.04).finished();
    const RegistrationResult result = Run(Features(test::FurnishedRoom(), truth_, 7), map,
                                          Prior(BoxPlus(truth_, offset), 0.1, 0.03));
    EXPECT_TRUE(result.converged);
    ASSERT_GT(result.correspondences, 500);
    const Vector6d error = BoxMinus(result.estimate.mean.nav.T_world_body, truth_);
    // 1 cm noise, hundreds of points on each pair of walls: 1 mm; fits across corners add as much
    // again.
    EXPECT_LT(error.head<3>().norm(), 0.005);
    EXPECT_LT(error.tail<3>().norm(), 0.002);
    EXPECT_FALSE(result.degeneracy.any());
    EXPECT_LT(result.rms_residual, 0.03);
  }
}

// One registration in a map that is independent of it: no inflation is called for.
TEST_F(RegistrationTest, CovarianceIsThatOfRepeatedTrials) {
  config_.registration.noise_inflation = 1.0;
  double nees_position = 0.0, nees_rotation = 0.0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    const LocalMap map = MapOf(test::FurnishedRoom(), 10 + trial);
    RandomStream random(trial, "prior");
    Vector6d offset;
    for (int i = 0; i < 6; ++i) offset[i] = (i < 3 ? 0.05 : 0.02) * random.Normal();
    const RegistrationResult result = Run(Features(test::FurnishedRoom(), truth_, 1000 + trial),
                                          map, Prior(BoxPlus(truth_, offset), 0.05, 0.02));
    const FilterVector error = BoxMinus(result.estimate.mean, Prior(truth_, 0.0, 0.0).mean);
    const FilterMatrix& P = result.estimate.covariance;
    const Eigen::Vector3d p = error.segment<3>(nav_index::kPosition),
                          r = error.segment<3>(nav_index::kRotation);
    nees_position += p.dot(P.block<3, 3>(0, 0).inverse() * p) / kTrials;
    nees_rotation += r.dot(P.block<3, 3>(6, 6).inverse() * r) / kTrials;
  }
  // Three degrees of freedom: mean 3. The mean over 20 trials lies in [1.5, 4.9] with 99.8 %.
  for (const double nees : {nees_position, nees_rotation}) {
    EXPECT_GT(nees, 1.5);
    EXPECT_LT(nees, 4.9);
  }
}

// Errors of a sweep stay in the map that the next ones are registered to: the drift accounts for
// them. Among exact planes neither that nor what neighbours have in common asks for an inflation.
TEST_F(RegistrationTest, CovarianceIsThatOfSuccessiveSweepsInOneMap) {
  config_.registration.noise_inflation = 1.0;
  constexpr int kTrials = 16, kSweeps = 12;
  const double sigma_m = 0.002, sigma_rad = 0.001;  // of a step as an IMU tells it
  const Pose3 step(ExpSo3({0.0, 0.01, 0.02}), {0.06, 0.02, 0.0});
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    RandomStream random(trial, "steps");
    Pose3 truth = truth_;
    LocalMap map(config_.map);
    map.Insert(Features(test::FurnishedRoom(), truth, 1000 * trial), truth);
    StateEstimate estimate = Prior(truth, 1e-4, 1e-5);
    Matrix6d drift = Matrix6d::Zero();
    for (int k = 1; k <= kSweeps; ++k) {
      Vector6d noise;
      for (int i = 0; i < 6; ++i) noise[i] = (i < 3 ? sigma_m : sigma_rad) * random.Normal();
      truth = truth * step;
      const Pose3 before = estimate.mean.nav.T_world_body;
      StateEstimate prior = Prior(BoxPlus(before * step, noise), sigma_m, sigma_rad);
      AddPoseCovariance(GrownDrift(PoseCovariance(estimate.covariance), before, prior, 0.0),
                        prior.covariance);
      const SweepFeatures features = Features(test::FurnishedRoom(), truth, 1000 * trial + k);
      estimate = Run(features, map, prior).estimate;
      const double new_share = map.Insert(features, estimate.mean.nav.T_world_body);
      drift = GrownDrift(drift, before, estimate, new_share);
    }
    const FilterVector error = BoxMinus(estimate.mean, Prior(truth, 0.0, 0.0).mean);
    Vector6d e;
    e << error.segment<3>(nav_index::kPosition), error.segment<3>(nav_index::kRotation);
    const Matrix6d P = PoseCovariance(estimate.covariance) + drift;
    nees += e.dot(P.ldlt().solve(e)) / kTrials;
  }
  // Six degrees of freedom: the mean over 16 trials lies in [4.0, 8.5] with 99 %.
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 8.5);
}

TEST_F(RegistrationTest, CovarianceFollowsTheResidualsNotTheNoiseToldOfTheLidar) {
  const LocalMap map = MapOf(test::FurnishedRoom(), 1);
  const SweepFeatures features = Features(test::FurnishedRoom(), truth_, 7);
  const auto sigma = [&](double told) {
    rig_.lidar->range_noise = told;
    const RegistrationResult result = Run(features, map, Prior(truth_, 0.1, 0.02));
    return std::sqrt(PoseCovariance(result.estimate.covariance).topLeftCorner<3, 3>().trace());
  };
  const double honest = sigma(0.01), generous = sigma(0.03);
  EXPECT_NEAR(generous / honest, 1.0, 0.2);  // three times the noise: about 2 if it were believed
}

TEST_F(RegistrationTest, InACorridorTheAxisIsFoundAndThePriorDecides) {
  const test::BoxWorld corridor = test::EndlessCorridor();
  rig_.lidar->max_range = 20.0;
  const LocalMap map = MapOf(corridor, 1);
  const Pose3 shifted(truth_.rotation(), truth_.translation() + Eigen::Vector3d(0.1, 0.04, -0.03));
  const StateEstimate prior = Prior(shifted, 0.1, 0.01);
  const RegistrationResult result = Run(Features(corridor, truth_, 7), map, prior);
  ASSERT_EQ(result.degeneracy.translation_directions, 1);
  EXPECT_EQ(result.degeneracy.rotation_directions, 0);
  EXPECT_GT(std::abs(result.degeneracy.translation_axes(0, 0)), 0.999);
  const Eigen::Vector3d p = result.estimate.mean.nav.T_world_body.translation();
  EXPECT_NEAR(p.x(), shifted.translation().x(), 0.002);  // nothing but the prior
  EXPECT_NEAR(p.y(), truth_.translation().y(), 0.005);   // the walls
  EXPECT_NEAR(p.z(), truth_.translation().z(), 0.005);
  EXPECT_NEAR(std::sqrt(result.estimate.covariance(0, 0)), 0.1, 0.01);
  EXPECT_LT(std::sqrt(result.estimate.covariance(1, 1)), 0.01);
  // What is reported is what was heard.
  const Eigen::Vector3d axis = truth_.R().transpose() * result.degeneracy.translation_axes.col(0);
  const Eigen::Matrix3d information = result.degeneracy.information.topLeftCorner<3, 3>();
  EXPECT_LT(axis.dot(information * axis), 1e-3 * information.norm());
}

TEST_F(RegistrationTest, InACorridorSurfacesThatFaceAlongItTellTheAxis) {
  rig_.lidar->max_range = 20.0;
  const Pose3 shifted(truth_.rotation(), truth_.translation() + Eigen::Vector3d(0.1, 0.04, -0.03));
  for (const double distance : {7.0, 9.0, 11.0}) {
    test::BoxWorld corridor = test::EndlessCorridor();
    corridor.obstacles = {{{distance, -1.2, -1.2}, {distance + 0.5, -0.5, 1.6}}};
    const RegistrationResult result =
        Run(Features(corridor, truth_, 7), MapOf(corridor, 1), Prior(shifted, 0.1, 0.01));
    EXPECT_TRUE(result.lone_axis.has_value());  // most constraints only feign to know it
    EXPECT_EQ(result.degeneracy.translation_directions, 0);
    const double sigma = std::sqrt(result.estimate.covariance(0, 0));
    EXPECT_LT(sigma, 0.02);
    EXPECT_NEAR(result.estimate.mean.nav.T_world_body.translation().x(), truth_.translation().x(),
                3.0 * sigma);
  }
}

TEST_F(RegistrationTest, InACorridorMarksTellTheAxis) {
  rig_.lidar->max_range = 20.0;
  test::BoxWorld corridor = test::EndlessCorridor();
  corridor.obstacles = {{{3.0, -1.2, -1.2}, {4.0, -1.14, 1.6}}};  // a pilaster, 6 cm proud
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  LocalMap map = MapOf(corridor, 1);
  for (int i = 0; i < 6; ++i) {
    const Pose3 T(truth_.rotation(), truth_.translation() - 0.1 * (6 - i) * axis);
    map.Insert(WithMarks(corridor, T, axis, 50 + i), T);
  }
  const Pose3 shifted(truth_.rotation(), truth_.translation() + Eigen::Vector3d(0.04, 0.02, -0.02));
  SweepFeatures features = WithMarks(corridor, truth_, axis, 7);
  ASSERT_GT(features.marks.size(), 20U);
  const auto run = [&] {
    return Register(features, map, Prior(shifted, 0.05, 0.01), *rig_.lidar, axis,
                    config_.registration, config_.degeneracy);
  };
  const RegistrationResult told = run();
  EXPECT_EQ(told.degeneracy.translation_directions, 0);
  EXPECT_TRUE(told.lone_axis.has_value());
  const double sigma = std::sqrt(told.estimate.covariance(0, 0));
  EXPECT_LT(sigma, 0.02);
  EXPECT_NEAR(told.estimate.mean.nav.T_world_body.translation().x(), truth_.translation().x(),
              2.0 * sigma);
  features.marks.clear();
  const RegistrationResult untold = run();
  EXPECT_EQ(untold.degeneracy.translation_directions, 1);
  EXPECT_NEAR(untold.estimate.mean.nav.T_world_body.translation().x(), shifted.translation().x(),
              0.002);
}

TEST_F(RegistrationTest, AnUncertainAxisDoesNotTurnNoiseAcrossItIntoMotionAlongIt) {
  const test::BoxWorld corridor = test::EndlessCorridor();
  rig_.lidar->max_range = 20.0;
  const LocalMap map = MapOf(corridor, 1);
  const Pose3 shifted(truth_.rotation(), truth_.translation() + Eigen::Vector3d(0.0, 0.01, 0.0));
  // Two metres of uncertainty along a direction half a degree off the corridor's: seen strictly,
  // the centimetre across it asks for a metre along it.
  StateEstimate prior = Prior(shifted, 0.01, 0.001);
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 0.01, 0.0).normalized();
  prior.covariance.topLeftCorner<3, 3>() += 4.0 * along * along.transpose();
  const RegistrationResult result = Run(Features(corridor, truth_, 7), map, prior);
  const Eigen::Vector3d p = result.estimate.mean.nav.T_world_body.translation();
  EXPECT_NEAR(p.x(), shifted.translation().x(), 0.01);
  EXPECT_NEAR(p.y(), truth_.translation().y(), 0.005);
  EXPECT_GT(std::sqrt(result.estimate.covariance(0, 0)), 1.5);
  EXPECT_LT(std::sqrt(result.estimate.covariance(1, 1)), 0.005);
}

TEST_F(RegistrationTest, WhatHasNotConvergedIsKnownNoBetterThanItsStep) {
  const LocalMap map = MapOf(test::FurnishedRoom(), 1);
  const SweepFeatures features = Features(test::FurnishedRoom(), truth_, 7);
  const Vector6d offset = (Vector6d() << 0.15, -0.1, 0.1, 0.03, -0.03, 0.04).finished();
  config_.registration.max_iterations = 2;
  const RegistrationResult result = Run(features, map, Prior(BoxPlus(truth_, offset), 0.2, 0.1));
  ASSERT_FALSE(result.converged);
  // The first step went most of the way.
  const Matrix6d P = PoseCovariance(result.estimate.covariance);
  EXPECT_GT(std::sqrt(P.topLeftCorner<3, 3>().diagonal().minCoeff()), 0.1);
  EXPECT_GT(std::sqrt(P.bottomRightCorner<3, 3>().diagonal().minCoeff()), 0.03);
  config_.registration.max_iterations = 8;
  const RegistrationResult settled = Run(features, map, Prior(BoxPlus(truth_, offset), 0.2, 0.1));
  ASSERT_TRUE(settled.converged);
  EXPECT_LT(std::sqrt(PoseCovariance(settled.estimate.covariance).trace()), 0.01);
}

TEST_F(RegistrationTest, PointsWithoutExtentTellNothing) {
  config_.map.min_spacing = 0.0;
  LocalMap map(config_.map);
  SweepFeatures spots;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3f spot(0.1F * static_cast<float>(i), 2.0F, 1.0F);
    for (int k = 0; k < 6; ++k) spots.map_planes.push_back(spot);
    spots.planes.push_back(spot);
    spots.plane_lags.push_back(0.0F);
  }
  map.Insert(spots, Pose3());
  config_.map.min_spacing = LocalMapConfig().min_spacing;
  config_.registration.max_neighbor_distance = config_.registration.max_search_distance = 0.05;
  const RegistrationResult result = Run(spots, map, Prior(Pose3(), 0.01, 0.001));
  EXPECT_EQ(result.correspondences, 0);
  EXPECT_TRUE(result.estimate.covariance.allFinite());
  EXPECT_EQ(BoxMinus(result.estimate.mean, FilterState()).norm(), 0.0);
}

TEST_F(RegistrationTest, SaysSoWhenThereIsNothingToRegisterTo) {
  const LocalMap empty(config_.map);
  const StateEstimate prior = Prior(truth_, 0.1, 0.01);
  const RegistrationResult result = Run(Features(test::FurnishedRoom(), truth_, 7), empty, prior);
  EXPECT_EQ(result.correspondences, 0);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(BoxMinus(result.estimate.mean, prior.mean).norm(), 0.0);
}

TEST_F(RegistrationTest, TheSameAtAnyNumberOfThreads) {
  const LocalMap map = MapOf(test::FurnishedRoom(), 1);
  const SweepFeatures features = Features(test::FurnishedRoom(), truth_, 7);
  std::vector<RegistrationResult> results;
  for (const int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    results.push_back(Run(features, map, Prior(truth_, 0.1, 0.02)));
  }
  EXPECT_EQ(BoxMinus(results[0].estimate.mean, results[1].estimate.mean).norm(), 0.0);
  EXPECT_EQ(results[0].estimate.covariance, results[1].estimate.covariance);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/placement.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

Pose3 RandomPose(RandomStream& random) {
  const auto vector = [&](double scale) {
    return Eigen::Vector3d(scale *
                           Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()));
  };
  return Pose3(ExpSo3(vector(1.0)), vector(10.0));
}

Pose3 Turned(double yaw, const Eigen::Vector3d& shift) {
  return Pose3(ExpSo3({0.0, 0.0, yaw}), shift);
}

TEST(WorldOfStart, FindsTheTurnAboutTheVerticalAndTheShift) {
  RandomStream random(1);
  for (int i = 0; i < 50; ++i) {
    const Pose3 body = RandomPose(random);
    const Pose3 T_world_level = Turned(3.0 * random.Normal(), RandomPose(random).translation());
    EXPECT_LT(BoxMinus(WorldOfStart(body, T_world_level * body), T_world_level).norm(), 1e-9);
  }
}

TEST(WorldOfStart, KeepsTheStartLevelWhateverThePredictionSays) {
  RandomStream random(2);
  const Pose3 body = RandomPose(random), place = RandomPose(random);
  const Pose3 T_world_level = WorldOfStart(body, place);
  EXPECT_LT((T_world_level.R().col(2) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT(((T_world_level * body).translation() - place.translation()).norm(), 1e-12);
}

// Against the definition: disturb the place, see where a state of the start comes to lie.
TEST(PlacementError, IsWhatADisturbedPlaceDoesToTheStates) {
  RandomStream random(3);
  const Pose3 first = RandomPose(random), state = RandomPose(random);
  const Matrix6d factor = Matrix6d::Random();
  const Placement placement{first, factor * factor.transpose()};
  Matrix6d J;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = kStep * Vector6d::Unit(i);  // world position, body rotation
    const Pose3 disturbed(first.rotation() * ExpSo3(d.tail<3>()),
                          first.translation() + d.head<3>());
    // Only the heading of the disturbance counts: the turn about the vertical by its share of it.
    const Eigen::Vector3d axis = first.R() * d.tail<3>();
    const Pose3 moved = Pose3::FromTranslation(disturbed.translation()) *
                        Turned(axis.z(), Eigen::Vector3d::Zero()) *
                        Pose3::FromTranslation(-first.translation()) * state;
    J.col(i) << (moved.translation() - state.translation()) / kStep,
        LogSo3(state.rotation().conjugate() * moved.rotation()) / kStep;
  }
  const Matrix6d expected = J * placement.covariance * J.transpose();
  EXPECT_LT((PlacementError(placement, state) - expected).norm(), 1e-4 * expected.norm());
}

class PlaceOfTest : public ::testing::Test {
 protected:
  PlaceOfTest() {
    last_.mean.nav.T_world_body = Pose3::FromTranslation({1.0, 2.0, 3.0});
    prediction_.mean.nav.T_world_body = Pose3::FromTranslation({4.0, 2.0, 3.0});
    prediction_.covariance.setIdentity();
  }
  LioConfig config_;
  StateEstimate last_, prediction_;
};

TEST_F(PlaceOfTest, ThePredictionHoldsAsLongAsTheImuWasThere) {
  const Placement placement = PlaceOf(last_, prediction_, 0.0, 5.0, config_);
  EXPECT_EQ(placement.T_world_body.translation().x(), 4.0);
  EXPECT_EQ(placement.covariance(0, 0), 1.0);
}

TEST_F(PlaceOfTest, WithoutImuTheBodyIsWhereItWasLastSeenAndMayHaveGoneAnywhere) {
  const Placement placement = PlaceOf(last_, prediction_, 60.0, 60.0, config_);
  EXPECT_EQ(placement.T_world_body.translation().x(), 1.0);
  EXPECT_NEAR(std::sqrt(placement.covariance(0, 0)), 60.0 * config_.start.max_speed, 1e-9);
  EXPECT_NEAR(std::sqrt(placement.covariance(5, 5)), 1.8138, 1e-3);  // any heading
  const Placement year = PlaceOf(last_, prediction_, 3e7, 3e7, config_);
  EXPECT_LE(std::sqrt(year.covariance(0, 0)), 1000.0 + 1e-9);
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/graph/keyframe_graph.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

constexpr double kTurnRate = 0.4;  // rad/s
constexpr double kRadius = 4.0;    // m
constexpr double kGravity = 9.81;
constexpr double kImuRate = 200.0;
constexpr double kStep = 0.5;      // s between odometry estimates
constexpr double kReplaced = 0.1;  // share of the map that is new at each of them

Rig TestRig() {
  Rig rig;
  rig.gravity = kGravity;
  rig.imu.rate_hz = kImuRate;
  rig.imu.noise = {.accelerometer_density = 1e-2,
                   .gyroscope_density = 1e-3,
                   .accelerometer_random_walk = 1e-4,
                   .gyroscope_random_walk = 1e-5};
  return rig;
}

// A body that walks a circle in the horizontal plane, facing along it: exact states and IMU in
// closed form.
NavState CircleState(double t) {
  const double angle = kTurnRate * t;
  NavState state;
  state.stamp = Time::FromSeconds(t);
  state.T_world_body = Pose3(ExpSo3({0.0, 0.0, angle}),
                             {kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), 0.0});
  state.v_world_body = kRadius * kTurnRate * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
  return state;
}

std::vector<ImuSample> CircleImu(double from, double to) {
  std::vector<ImuSample> samples;
  const int n = static_cast<int>(std::lround((to - from) * kImuRate));
  for (int i = 0; i <= n; ++i) {
    samples.push_back({.stamp = Time::FromSeconds(from + i / kImuRate),
                       .angular_velocity = {0.0, 0.0, kTurnRate},
                       .linear_acceleration = {0.0, kRadius * kTurnRate * kTurnRate, kGravity}});
  }
  return samples;
}

OdometryEstimate EstimateOf(const NavState& state) {
  OdometryEstimate estimate;
  estimate.state = state;
  Vector15d sigma;
  sigma << Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-2),
      Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-2),
      Eigen::Vector3d::Constant(1e-3);
  estimate.covariance = sigma.cwiseAbs2().asDiagonal();
  estimate.degeneracy.information = 1e6 * Matrix6d::Identity();
  estimate.map = MapTie{.covariance = 1e-6 * Matrix6d::Identity(),
                        .age = -std::log1p(-kReplaced) * state.stamp.seconds() / kStep};
  return estimate;
}

// A start of a single state.
Expected<GraphUpdate> BeginWith(KeyframeGraph& graph, const OdometryEstimate& estimate) {
  const std::shared_ptr<const PointCloud> no_cloud;
  return graph.Begin({.estimates = {&estimate, 1}, .clouds = {&no_cloud, 1}, .relative = {}});
}

// The earlier states are known to 1 cm and 10 mrad, as seen from the last one.
Expected<GraphUpdate> BeginAfterGapWith(KeyframeGraph& graph,
                                        std::span<const OdometryEstimate> start,
                                        const Matrix6d& gap) {
  const std::vector<std::shared_ptr<const PointCloud>> no_clouds(start.size());
  const std::vector<Matrix6d> relative(start.size() - 1, 1e-4 * Matrix6d::Identity());
  return graph.BeginAfterGap({.estimates = start, .clouds = no_clouds, .relative = relative}, gap);
}

GraphUpdate AddAt(KeyframeGraph& graph, double t, const OdometryEstimate& estimate) {
  const Expected<GraphUpdate> update =
      t > 0.0 ? graph.Add(estimate, nullptr, CircleImu(t - kStep, t)) : BeginWith(graph, estimate);
  EXPECT_TRUE(update.has_value()) << update.error().message;
  return *update;
}

TEST(KeyframeGraph, KeyframesByDistanceAngleAndTime) {
  KeyframeGraph graph({.keyframe_distance = 1.0, .keyframe_angle = 0.5, .keyframe_interval = 5.0},
                      TestRig());
  NavState state = CircleState(0.0);
  EXPECT_TRUE(graph.WantsKeyframe(state));
  AddAt(graph, 0.0, EstimateOf(state));
  EXPECT_FALSE(graph.WantsKeyframe(state));
  NavState moved = state, turned = state, waited = state;
  moved.T_world_body = Pose3::FromTranslation({0.0, 1.01, 0.0});
  turned.T_world_body = Pose3(ExpSo3({0.51, 0.0, 0.0}), Eigen::Vector3d::Zero());
  waited.stamp = state.stamp + Duration::FromSeconds(5.1);
  EXPECT_TRUE(graph.WantsKeyframe(moved));
  EXPECT_TRUE(graph.WantsKeyframe(turned));
  EXPECT_TRUE(graph.WantsKeyframe(waited));
}

TEST(KeyframeGraph, ReproducesExactMeasurements) {
  KeyframeGraph graph({}, TestRig());
  for (double t = 0.0; t < 20.0; t += kStep) AddAt(graph, t, EstimateOf(CircleState(t)));
  for (const Keyframe& keyframe : graph.keyframes()) {
    const Vector15d error =
        BoxMinus(graph.Estimate(keyframe.id), CircleState(keyframe.state.stamp.seconds()));
    EXPECT_LT(error.head<3>().norm(), 1e-3);
    EXPECT_LT(error.segment<3>(nav_index::kVelocity).norm(), 1e-2);
    EXPECT_LT(error.segment<3>(nav_index::kRotation).norm(), 1e-4);
  }
}

// The odometry's frame is a matter of convention, as long as it is level.
TEST(KeyframeGraph, AnotherFrameOfTheOdometryGivesTheSameFactors) {
  const Pose3 T_other(ExpSo3({0.0, 0.0, 2.0}), {30.0, -20.0, 5.0});
  KeyframeGraph graph({}, TestRig()), other({}, TestRig());
  for (double t = 0.0; t < 10.0; t += kStep) {
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    // The odometry errs, so that there is something to correct.
    estimate.degeneracy.information *= 1e-2;
    estimate.state.T_world_body =
        Pose3::FromTranslation({0.0, 0.0, 0.01 * t}) * estimate.state.T_world_body;
    AddAt(graph, t, estimate);
    estimate.state.T_world_body = T_other * estimate.state.T_world_body;
    estimate.state.v_world_body = T_other.rotation() * estimate.state.v_world_body;
    AddAt(other, t, estimate);
  }
  for (const Keyframe& keyframe : graph.keyframes()) {
    const NavState a = graph.Estimate(keyframe.id), b = other.Estimate(keyframe.id);
    EXPECT_LT(BoxMinus(T_other * a.T_world_body, b.T_world_body).norm(), 1e-6);
    EXPECT_LT((T_other.rotation() * a.v_world_body - b.v_world_body).norm(), 1e-6);
  }
}

TEST(KeyframeGraph, OdometryErrorsAlongDegenerateDirectionsDoNotEnter) {
  KeyframeGraph graph({}, TestRig());
  for (double t = 0.0; t < 4.0; t += kStep) {
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    // The registration cannot tell the body's x direction, and the odometry slides 0.2 m along it
    // at each keyframe.
    estimate.degeneracy.information.row(0).setZero();
    estimate.degeneracy.information.col(0).setZero();
    estimate.map->covariance(0, 0) = 1e-6 + 0.4 * 0.4 * t * t;
    estimate.state.T_world_body = BoxPlus(estimate.state.T_world_body, 0.4 * t * Vector6d::Unit(0));
    AddAt(graph, t, estimate);
  }
  const Keyframe& last = graph.keyframes().back();
  const double odometry_error = (last.state.T_world_body.translation() -
                                 CircleState(last.state.stamp.seconds()).T_world_body.translation())
                                    .norm();
  const double graph_error =
      BoxMinus(graph.Estimate(last.id), CircleState(last.state.stamp.seconds())).head<3>().norm();
  EXPECT_GT(odometry_error, 1.0);
  EXPECT_LT(graph_error, 0.05);
}

// The world's x direction is open for four seconds; the odometry drifts along it by 0.3 m until the
// map tells it again.
TEST(KeyframeGraph, BeyondABlindStretchTheMapTellsThePositionAgainAndTheWayBetweenIsSmoothed) {
  KeyframeGraph graph({}, TestRig());
  for (double t = 0.0; t <= 10.0; t += kStep) {
    const bool blind = t > 3.0 && t < 7.0;
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    const Eigen::Vector3d x_body =
        estimate.state.T_world_body.R().transpose() * Eigen::Vector3d::UnitX();
    if (blind) {
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - x_body * x_body.transpose();
      estimate.degeneracy.information.topLeftCorner<3, 3>() = 1e6 * across;
      estimate.map->covariance.topLeftCorner<3, 3>() += 0.3 * 0.3 * x_body * x_body.transpose();
      const Pose3 drift = Pose3::FromTranslation({0.1 * (t - 3.0), 0.0, 0.0});
      estimate.state.T_world_body = drift * estimate.state.T_world_body;
    }
    AddAt(graph, t, estimate);
  }
  double worst_odometry = 0.0;
  for (const Keyframe& keyframe : graph.keyframes()) {
    const NavState truth = CircleState(keyframe.state.stamp.seconds());
    worst_odometry = std::max(worst_odometry, BoxMinus(keyframe.state, truth).head<3>().norm());
    const double error = BoxMinus(graph.Estimate(keyframe.id), truth).head<3>().norm();
    EXPECT_LT(error, keyframe.state.stamp.seconds() < 7.0 ? 0.03 : 0.01)
        << keyframe.state.stamp.seconds();
  }
  EXPECT_GT(worst_odometry, 0.3);
}

// An odometry against a map of which, sweep by sweep, a share is replaced by what is seen around
// its own estimate: the point that the registration hangs on is with that probability a new one, in
// the wrong place as the estimate is.
class DriftingMap {
 public:
  explicit DriftingMap(std::uint64_t seed) : random_(seed, "drifting map") {}

  OdometryEstimate At(double t) {
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    NavState& state = estimate.state;
    const Pose3 truth = state.T_world_body;
    const Vector15d sigma = estimate.covariance.diagonal().cwiseSqrt();
    const Vector15d error = sigma.cwiseProduct(Normal<15>());
    if (t == 0.0) {
      state = BoxPlus(state, error);
      bias_ = error.tail<6>();
    } else {
      state.T_world_body = map_ * BoxPlus(truth, 1e-3 * Normal<6>());
    }
    if (t == 0.0 || random_.Uniform() < kReplaced) map_ = state.T_world_body * truth.inverse();
    return estimate;
  }

  // With the noise of TestRig and the biases whose estimate at the beginning is off by `bias_`.
  std::vector<ImuSample> Imu(double from, double to) {
    const ImuNoise noise = TestRig().imu.noise;
    std::vector<ImuSample> samples = CircleImu(from, to);
    for (ImuSample& sample : samples) {
      sample.linear_acceleration +=
          noise.accelerometer_density * std::sqrt(kImuRate) * Normal<3>() - bias_.head<3>();
      sample.angular_velocity +=
          noise.gyroscope_density * std::sqrt(kImuRate) * Normal<3>() - bias_.tail<3>();
    }
    return samples;
  }

 private:
  template <int N>
  Eigen::Matrix<double, N, 1> Normal() {
    Eigen::Matrix<double, N, 1> v;
    for (double& x : v) x = random_.Normal();
    return v;
  }
  RandomStream random_;
  Pose3 map_;  // the map's error
  Vector6d bias_ = Vector6d::Zero();
};

// Mean over runs of the normalised error squared of the last pose; 6 expected.
double MeanNees(bool map_grows_old, int runs) {
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    KeyframeGraph graph({}, TestRig());
    DriftingMap odometry(run);
    std::optional<GraphUpdate> update;
    for (double t = 0.0; t <= 12.0; t += kStep) {
      OdometryEstimate estimate = odometry.At(t);
      if (!map_grows_old) estimate.map->age = 0.0;
      const auto added = t > 0.0 ? graph.Add(estimate, nullptr, odometry.Imu(t - kStep, t))
                                 : BeginWith(graph, estimate);
      EXPECT_TRUE(added.has_value());
      if (added) update = *added;
    }
    const Pose3& pose = update->newest.T_world_body;
    const Vector6d error = BoxMinus(CircleState(update->newest.stamp.seconds()).T_world_body, pose);
    sum += error.dot(PoseChartCovariance(pose.R(), update->covariance).inverse() * error);
  }
  return sum / runs;
}

TEST(KeyframeGraph, CovariancesTellTheDriftOfTheMap) {
  // Were errors normal, the mean over 60 runs would lie in 4.9 .. 7.2 with 99 %; a map that jumps
  // has longer tails.
  const double nees = MeanNees(true, 60);
  EXPECT_GT(nees, 4.5);
  EXPECT_LT(nees, 7.5);
  EXPECT_GT(MeanNees(false, 20), 10.0);  // a map that is taken for eternal
}

TEST(KeyframeGraph, AnOdometryWithoutAMapHangsOnItsMotion) {
  KeyframeGraph graph({}, TestRig());
  for (double t = 0.0; t < 10.0; t += kStep) {
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    estimate.map.reset();
    const NavState from = CircleState(t - kStep);
    const MotionPrior motion{.from = from.stamp,
                             .to = estimate.state.stamp,
                             .T_from_to = from.T_world_body.inverse() * estimate.state.T_world_body,
                             .covariance = 1e-6 * Matrix6d::Identity()};
    const auto added = t > 0.0 ? graph.Add(estimate, nullptr, CircleImu(t - kStep, t), motion)
                               : BeginWith(graph, estimate);
    ASSERT_TRUE(added.has_value());
    const Keyframe& last = graph.keyframes().back();
    EXPECT_LT(BoxMinus(graph.Estimate(last.id), CircleState(t)).head<3>().norm(), 1e-3);
  }
}

TEST(KeyframeGraph, ALoopRemovesDriftAndAWrongOneDoesNotBendTheMap) {
  const auto drifted = [](KeyframeGraph& graph) {
    Pose3 drift;
    for (double t = 0.0; t <= 15.5; t += kStep) {  // a full circle
      OdometryEstimate estimate = EstimateOf(CircleState(t));
      estimate.degeneracy.information *= 1e-2;
      drift = drift * Pose3::FromTranslation({0.0, 0.0, 0.005});
      estimate.state.T_world_body = drift * estimate.state.T_world_body;
      AddAt(graph, t, estimate);
    }
    return graph.keyframes().back().id;
  };
  const auto error_of_last = [](const KeyframeGraph& graph) {
    const Keyframe& last = graph.keyframes().back();
    return BoxMinus(graph.Estimate(last.id), CircleState(last.state.stamp.seconds()))
        .head<3>()
        .norm();
  };
  GraphConfig config;
  config.map_position_sigma = 0.02;
  KeyframeGraph right(config, TestRig()), wrong(config, TestRig());
  const KeyframeId last = drifted(right);
  drifted(wrong);
  const double before = error_of_last(right);
  const NavState truth = CircleState(right.keyframes().back().state.stamp.seconds());
  const Pose3 T_first_last = CircleState(0.0).T_world_body.inverse() * truth.T_world_body;
  const Matrix6d covariance = 1e-6 * Matrix6d::Identity();
  ASSERT_TRUE(right.AddLoop(KeyframeId(0), last, T_first_last, covariance));
  ASSERT_TRUE(
      wrong.AddLoop(KeyframeId(0), last, Pose3::FromTranslation({20.0, 0.0, 0.0}), covariance));
  EXPECT_GT(before, 0.1);
  EXPECT_LT(error_of_last(right), 0.3 * before);
  EXPECT_LT(error_of_last(wrong), 2.0 * before);
  EXPECT_EQ(right.loops(), 1);
}

// Two walks along the circle with a minute between them, the second placed wrongly by a turn of 40
// degrees and some metres, as the gap's covariance admits. The parameter: how many states the second
// start has.
class GapTest : public ::testing::TestWithParam<int> {
 protected:
  explicit GapTest(double position_sigma = 180.0) {
    for (double t = 0.0; t <= kFirstEnd; t += kStep) AddAt(graph_, t, EstimateOf(CircleState(t)));
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(position_sigma), 0.02, 0.02, 1.8;
    gap_ = sigma.cwiseAbs2().asDiagonal();
    Begin();
    for (double t = kSecond + kStep; t <= kSecond + 8.0; t += kStep)
      AddAt(graph_, t, PlacedWrongly(t));
  }
  OdometryEstimate PlacedWrongly(double t) const {
    OdometryEstimate estimate = EstimateOf(CircleState(t));
    estimate.state.T_world_body = T_wrong_ * estimate.state.T_world_body;
    estimate.state.v_world_body = T_wrong_.rotation() * estimate.state.v_world_body;
    return estimate;
  }
  // The start ends at kSecond; every other state of it is a keyframe.
  void Begin() {
    std::vector<OdometryEstimate> start;
    for (int before = GetParam() - 1; before >= 0; --before) {
      OdometryEstimate estimate = PlacedWrongly(kSecond - before * kStep);
      estimate.covariance(8, 8) = gap_(5, 5);  // the heading
      estimate.covariance.topLeftCorner<3, 3>() = gap_.topLeftCorner<3, 3>();
      if (before > 0) estimate.map.reset();
      start.push_back(estimate);
    }
    begin_ = graph_.keyframes().size();
    const auto update = BeginAfterGapWith(graph_, start, gap_);
    ASSERT_TRUE(update.has_value()) << update.error().message;
    ASSERT_EQ(graph_.keyframes().size() - begin_, (start.size() + 1) / 2);
    EXPECT_EQ(graph_.keyframes()[begin_].state.stamp, start.front().state.stamp);
  }
  // Of the second walk by itself: greatest difference of relative poses to the truth.
  double SecondWalkError() const {
    const Keyframe& begin = graph_.keyframes()[begin_];
    const Pose3 first = graph_.Estimate(begin.id).T_world_body;
    const Pose3 T_first_world = CircleState(begin.state.stamp.seconds()).T_world_body.inverse();
    double error = 0.0;
    for (std::size_t i = begin_; i < graph_.keyframes().size(); ++i) {
      const Keyframe& keyframe = graph_.keyframes()[i];
      const Pose3 truth = T_first_world * CircleState(keyframe.state.stamp.seconds()).T_world_body;
      error = std::max(
          error,
          BoxMinus(first.inverse() * graph_.Estimate(keyframe.id).T_world_body, truth).norm());
    }
    return error;
  }

  static constexpr double kFirstEnd = 8.0, kSecond = 68.0;
  Pose3 T_wrong_{ExpSo3({0.0, 0.0, 0.7}), {5.0, -8.0, 1.0}};
  Matrix6d gap_;
  KeyframeGraph graph_{{}, TestRig()};
  std::size_t begin_ = 0;
};

constexpr auto NameOfStart = [](const ::testing::TestParamInfo<int>& info) {
  return info.param == 1 ? "OneState" : "FiveStates";
};

INSTANTIATE_TEST_SUITE_P(Starts, GapTest, ::testing::Values(1, 5), NameOfStart);

TEST_P(GapTest, BothPartsStayAsGoodAsTheyWereAndWhereTheyWerePut) {
  for (std::size_t i = 0; i < begin_; ++i) {
    const Keyframe& keyframe = graph_.keyframes()[i];
    EXPECT_LT(BoxMinus(graph_.Estimate(keyframe.id), CircleState(keyframe.state.stamp.seconds()))
                  .head<3>()
                  .norm(),
              1e-3);
  }
  EXPECT_LT(SecondWalkError(), 2e-3);
  const Keyframe& last = graph_.keyframes().back();
  EXPECT_LT(BoxMinus(graph_.Estimate(last.id).T_world_body, last.state.T_world_body).norm(), 1e-2);
}

TEST_P(GapTest, CovariancesTellTheGap) {
  const auto update =
      graph_.Add(PlacedWrongly(kSecond + 8.5), nullptr, CircleImu(kSecond + 8.0, kSecond + 8.5));
  ASSERT_TRUE(update.has_value());
  const Matrix15d& covariance = update->covariance;
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 180.0, 20.0);
  EXPECT_GT(std::sqrt(covariance(8, 8)), 1.5);   // 1.8 by the gap
  EXPECT_LT(std::sqrt(covariance(6, 6)), 0.01);  // roll by gravity
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix15d>(covariance).eigenvalues().minCoeff(), 0.0);
}

class VastGapTest : public GapTest {
 protected:
  VastGapTest() : GapTest(1e5) {}
};

INSTANTIATE_TEST_SUITE_P(Starts, VastGapTest, ::testing::Values(1, 5), NameOfStart);

// AddAt has checked that no keyframe behind the gap was left out.
TEST_P(VastGapTest, IsNoLessDeterminedThanTheWorldIsWide) {
  EXPECT_EQ(graph_.keyframes().back().state.stamp, Time::FromSeconds(kSecond + 8.0));
  EXPECT_LT(SecondWalkError(), 2e-3);
  EXPECT_GT(std::sqrt(graph_.newest()->covariance(0, 0)), 400.0);
}

TEST_P(GapTest, ALoopPutsTheSecondPartInItsPlaceWhole) {
  const double t = kSecond + 4.0;
  const auto seen =
      std::find_if(graph_.keyframes().begin(), graph_.keyframes().end(),
                   [&](const Keyframe& k) { return k.state.stamp == Time::FromSeconds(t); });
  ASSERT_NE(seen, graph_.keyframes().end());
  const Pose3 T_first_seen = CircleState(0.0).T_world_body.inverse() * CircleState(t).T_world_body;
  ASSERT_TRUE(graph_.AddLoop(KeyframeId(0), seen->id, T_first_seen, 1e-6 * Matrix6d::Identity()));
  EXPECT_TRUE(graph_.converged());
  EXPECT_LT(SecondWalkError(), 5e-3);
  for (std::size_t i = begin_; i < graph_.keyframes().size(); ++i) {
    const Keyframe& keyframe = graph_.keyframes()[i];
    EXPECT_LT(BoxMinus(graph_.Estimate(keyframe.id).T_world_body,
                       CircleState(keyframe.state.stamp.seconds()).T_world_body)
                  .norm(),
              2e-2);
  }
}

TEST(KeyframeGraph, OnlyABeginningNeedsNoKeyframeBeforeIt) {
  KeyframeGraph graph({}, TestRig());
  const OdometryEstimate estimate = EstimateOf(CircleState(0.0));
  EXPECT_THROW(BeginAfterGapWith(graph, {&estimate, 1}, Matrix6d::Identity()), ContractViolation);
  EXPECT_THROW(graph.Add(estimate, nullptr, {}), ContractViolation);
  EXPECT_THROW(graph.Settle(), ContractViolation);
  AddAt(graph, 0.0, estimate);
  EXPECT_THROW(BeginWith(graph, estimate), ContractViolation);
}

// A start of five states, half a second apart, whose errors are correlated.
class StartOfFive : public ::testing::Test {
 protected:
  StartOfFive() {
    RandomStream random(1, "start");
    Matrix15d root;
    for (double& x : root.reshaped()) x = random.Normal();
    const Vector15d sigma = EstimateOf(CircleState(0.0)).covariance.diagonal().cwiseSqrt();
    const Matrix15d covariance =
        sigma.asDiagonal() * Matrix15d(root * root.transpose() / 15.0) * sigma.asDiagonal();
    for (int k = 0; k < 5; ++k) {
      start_.push_back(EstimateOf(CircleState(k * kStep)));
      start_.back().covariance = covariance;
      if (k < 4) start_.back().map.reset();
    }
  }
  Expected<GraphUpdate> Begin(KeyframeGraph& graph, std::size_t from) const {
    return graph.Begin({.estimates = std::span(start_).subspan(from),
                        .clouds = std::span(clouds_).subspan(from),
                        .relative = std::span(relative_).subspan(from)});
  }

  GraphConfig config_{.keyframe_distance = 1.0};  // two steps of 0.8 m
  std::vector<OdometryEstimate> start_;
  std::vector<std::shared_ptr<const PointCloud>> clouds_ =
      std::vector<std::shared_ptr<const PointCloud>>(5, std::make_shared<PointCloud>());
  std::vector<Matrix6d> relative_ = std::vector<Matrix6d>(4, 1e-4 * Matrix6d::Identity());
};

TEST_F(StartOfFive, CountsOnceHoweverManyOfItsStatesAreKeyframes) {
  KeyframeGraph whole(config_, TestRig()), last(config_, TestRig());
  const auto update = Begin(whole, 0), alone = Begin(last, 4);
  ASSERT_TRUE(update.has_value() && alone.has_value());
  ASSERT_EQ(whole.keyframes().size(), 3U);
  ASSERT_EQ(last.keyframes().size(), 1U);
  // What the prior's floor of 0.1 mm and 0.1 mrad adds.
  const Matrix15d claimed = start_.back().covariance;
  Matrix15d floor = Matrix15d::Zero();
  floor.diagonal().head<3>().setConstant(1e-8);
  floor.diagonal().segment<3>(nav_index::kRotation).setConstant(1e-8);
  EXPECT_LT((alone->covariance - claimed - floor).norm(), 1e-6 * claimed.norm());
  EXPECT_LT((update->covariance - alone->covariance).norm(), 1e-9 * claimed.norm());
  // And the same after the next keyframe: nothing pulls at the start from behind.
  const OdometryEstimate next = EstimateOf(CircleState(5 * kStep));
  const auto imu = CircleImu(4 * kStep, 5 * kStep);
  const auto a = whole.Add(next, nullptr, imu), b = last.Add(next, nullptr, imu);
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_LT((a->covariance - b->covariance).norm(), 1e-9 * claimed.norm());
}

TEST_F(StartOfFive, KeepsItsStatesInOrderAndWhereTheyWereSeen) {
  KeyframeGraph graph(config_, TestRig());
  ASSERT_TRUE(Begin(graph, 0).has_value());
  for (std::size_t i = 0; i < graph.keyframes().size(); ++i) {
    const Keyframe& keyframe = graph.keyframes()[i];
    EXPECT_EQ(keyframe.id.value(), static_cast<std::int64_t>(i));
    EXPECT_EQ(keyframe.state.stamp, start_[2 * i].state.stamp);
    EXPECT_NE(keyframe.points, nullptr);
    EXPECT_LT(BoxMinus(graph.Estimate(keyframe.id), start_[2 * i].state).norm(), 1e-9);
  }
}

// A loop to a keyframe of the start moves it as far as its tie to the last state lets it.
TEST_F(StartOfFive, ALoopSharesItsErrorWithTheTieOfTheStart) {
  KeyframeGraph graph(config_, TestRig());
  ASSERT_TRUE(Begin(graph, 0).has_value());
  const KeyframeId first(0), last(2);
  const auto height = [&](KeyframeId id) { return graph.Estimate(id).T_world_body.translation(); };
  const Pose3 seen = start_[4].state.T_world_body.inverse() * start_[0].state.T_world_body;
  // As uncertain as the tie: half of the way remains.
  const Pose3 raised = Pose3::FromTranslation({0.0, 0.0, 4e-4}) * seen;
  ASSERT_TRUE(graph.AddLoop(last, first, raised, relative_[0]));
  EXPECT_TRUE(graph.converged());
  EXPECT_NEAR((height(first) - height(last)).z(), 2e-4, 0.01e-4);
}

TEST_F(StartOfFive, AStartThatCannotBeSolvedLeavesNoKeyframe) {
  KeyframeGraph graph(config_, TestRig());
  start_.back().state.v_world_body.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Begin(graph, 0).has_value());
  EXPECT_TRUE(graph.keyframes().empty());
  start_.back().state = CircleState(4 * kStep);
  EXPECT_TRUE(Begin(graph, 0).has_value());
  EXPECT_EQ(graph.keyframes().size(), 3U);
}

TEST(KeyframeGraph, ABadEstimateIsAnErrorAndLeavesTheGraphUsable) {
  KeyframeGraph graph({}, TestRig());
  AddAt(graph, 0.0, EstimateOf(CircleState(0.0)));
  OdometryEstimate bad = EstimateOf(CircleState(kStep));
  bad.state.v_world_body.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(graph.Add(bad, nullptr, CircleImu(0.0, kStep)));
  EXPECT_EQ(graph.keyframes().size(), 1U);
  AddAt(graph, kStep, EstimateOf(CircleState(kStep)));
  EXPECT_EQ(graph.keyframes().size(), 2U);
}

}  // namespace
}  // namespace mlvi

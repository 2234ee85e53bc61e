// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/graph/keyframe_graph.h"

#include <ceres/loss_function.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "mlvi/factors/between_factor.h"
#include "mlvi/factors/imu_factor.h"
#include "mlvi/factors/map_step_factor.h"
#include "mlvi/factors/pose_block.h"
#include "mlvi/factors/prior_factor.h"

namespace mlvi {
namespace {

using nav_index::kAccelerometerBias;
using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

// A square root S of a positive semi-definite matrix, S^T S = matrix.
template <int N>
Eigen::Matrix<double, N, N> SquareRoot(const Eigen::Matrix<double, N, N>& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(matrix);
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

template <int N>
Eigen::Matrix<double, N, N> SqrtInformationOf(const Eigen::Matrix<double, N, N>& covariance) {
  return SquareRoot<N>(covariance.inverse());
}

// A covariance of the pose chart that has an inverse.
Matrix6d Finite(const Matrix6d& covariance) { return covariance + 1e-8 * Matrix6d::Identity(); }

Eigen::Matrix<double, 6, 1> BiasVector(const ImuBias& bias) {
  return (Eigen::Matrix<double, 6, 1>() << bias.accelerometer, bias.gyroscope).finished();
}

}  // namespace

void GraphConfig::Declare(ConfigDeclaration& d) {
  d.Field("keyframe_distance", keyframe_distance, "m",
          "A keyframe at least so often: the map is made of them", {0.01, 100.0});
  d.Field("keyframe_angle", keyframe_angle, "rad", "A keyframe at least so often: new views",
          {0.01, 6.3});
  d.Field(
      "keyframe_interval", keyframe_interval, "s",
      "A keyframe at least so often, also at rest: preintegration loses validity over long times",
      {0.1, 60.0});
  d.Field("map_position_sigma", map_position_sigma, "m",
          "The LiDAR odometry's map bends at least so much from keyframe to keyframe", {1e-6, 1.0});
  d.Field("map_rotation_sigma", map_rotation_sigma, "rad",
          "The LiDAR odometry's map bends at least so much from keyframe to keyframe", {1e-6, 1.0});
  d.Field("relinearize_threshold", relinearize_threshold, "m, rad",
          "Variables farther from their linearisation point are linearised anew", {1e-6, 1.0});
  d.Field(
      "loop_loss_scale", loop_loss_scale, "sigma",
      "Loop factors count quadratically up to here (Cauchy): a wrong loop must not bend the map",
      {0.1, 100.0});
  d.Field("visual_loss_scale", visual_loss_scale, "sigma",
          "Factors of visual odometry count quadratically up to here (Cauchy)", {0.1, 100.0});
}

KeyframeGraph::KeyframeGraph(const GraphConfig& config, const Rig& rig)
    : config_(config),
      imu_(rig.imu),
      gravity_(rig.gravity),
      smoother_({.relinearize_threshold = config.relinearize_threshold}) {}

bool KeyframeGraph::WantsKeyframe(const NavState& state) const {
  if (!newest_) return true;
  const Vector6d step = BoxMinus(state.T_world_body, newest_->state.T_world_body);
  return step.head<3>().norm() >= config_.keyframe_distance ||
         step.tail<3>().norm() >= config_.keyframe_angle ||
         (state.stamp - newest_->state.stamp).seconds() >= config_.keyframe_interval;
}

Expected<GraphUpdate> KeyframeGraph::Add(const OdometryEstimate& estimate,
                                         std::shared_ptr<const PointCloud> points,
                                         std::span<const ImuSample> imu,
                                         const std::optional<MotionPrior>& visual) {
  const NavState guess = newest_ ? Guess(estimate) : estimate.state;
  Variables added = AddVariables(guess);
  if (newest_) {
    AddImuFactor(variables_.back(), added, imu, newest_->state.bias);
    AddMap(estimate, guess, added);
    if (visual) AddVisualOdometryFactor(*visual, added);
  } else {
    AddPrior(estimate, added);
  }
  return Commit(estimate, guess, added, std::move(points));
}

Expected<GraphUpdate> KeyframeGraph::AddAfterGap(const OdometryEstimate& estimate,
                                                 std::shared_ptr<const PointCloud> points,
                                                 const Matrix6d& gap) {
  MLVI_CHECK(newest_.has_value(), "a gap at {} without a keyframe before it",
             ToString(estimate.state.stamp));
  const NavState guess = Guess(estimate);
  const Variables added = AddVariables(guess);
  const Pose3 T_from_to = newest_->state.T_world_body.inverse() * estimate.state.T_world_body;
  smoother_.AddFactor(std::make_shared<BetweenFactor>(T_from_to, SqrtInformationOf<6>(Finite(gap))),
                      nullptr, {variables_.back().pose, added.pose});
  AddTiltPrior(estimate, added);
  // Three times the speed: less would tell the heading, against which the speed is measured.
  const Eigen::Matrix3d any_heading =
      9.0 * guess.v_world_body.squaredNorm() * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d velocity_covariance =
      estimate.covariance.block<3, 3>(kVelocity, kVelocity) + any_heading;
  smoother_.AddFactor(std::make_shared<VectorPriorFactor>(
                          guess.v_world_body, SqrtInformationOf<3>(velocity_covariance)),
                      nullptr, {added.velocity});
  AddBiasPrior(estimate, added);
  return Commit(estimate, guess, added, std::move(points));
}

NavState KeyframeGraph::Guess(const OdometryEstimate& estimate) const {
  const NavState smoothed = Estimate(keyframes_.back().id);
  const Pose3 T_smoothed_odometry = smoothed.T_world_body * newest_->state.T_world_body.inverse();
  NavState guess = estimate.state;
  guess.T_world_body = T_smoothed_odometry * estimate.state.T_world_body;
  guess.v_world_body = T_smoothed_odometry.rotation() * estimate.state.v_world_body;
  return guess;
}

Expected<GraphUpdate> KeyframeGraph::Commit(const OdometryEstimate& estimate, const NavState& guess,
                                            const Variables& added,
                                            std::shared_ptr<const PointCloud> points) {
  const KeyframeId id(static_cast<std::int64_t>(keyframes_.size()));
  keyframes_.push_back({.id = id, .state = estimate.state, .points = std::move(points)});
  variables_.push_back(added);
  Expected<GraphUpdate> update = Solve();
  if (!update) {
    smoother_.DiscardPending();
    keyframes_.pop_back();
    variables_.pop_back();
    return update;
  }
  newest_ = estimate;
  update->largest_position_change =
      (update->newest.T_world_body.translation() - guess.T_world_body.translation()).norm();
  return update;
}

Expected<GraphUpdate> KeyframeGraph::AddLoop(KeyframeId from, KeyframeId to, const Pose3& T_from_to,
                                             const Matrix6d& covariance) {
  const auto variables = [&](KeyframeId id) {
    MLVI_CHECK(id.valid() && id.value() < static_cast<std::int64_t>(variables_.size()),
               "keyframe {} of {}", id.value(), variables_.size());
    return variables_[static_cast<std::size_t>(id.value())];
  };
  smoother_.AddFactor(std::make_shared<BetweenFactor>(T_from_to, SqrtInformationOf<6>(covariance)),
                      std::make_shared<ceres::CauchyLoss>(config_.loop_loss_scale),
                      {variables(from).pose, variables(to).pose});
  const NavState before = Estimate(keyframes_.back().id);
  Expected<GraphUpdate> update = Solve();
  if (!update) {
    smoother_.DiscardPending();
    return update;
  }
  ++loops_;
  update->largest_position_change =
      (update->newest.T_world_body.translation() - before.T_world_body.translation()).norm();
  return update;
}

NavState KeyframeGraph::Estimate(KeyframeId id) const {
  MLVI_CHECK(id.valid() && id.value() < static_cast<std::int64_t>(variables_.size()),
             "keyframe {} of {}", id.value(), variables_.size());
  const auto index = static_cast<std::size_t>(id.value());
  const Variables& variables = variables_[index];
  NavState state;
  state.stamp = keyframes_[index].state.stamp;
  state.T_world_body = LoadPose(smoother_.Estimate(variables.pose).data());
  state.v_world_body =
      Eigen::Map<const Eigen::Vector3d>(smoother_.Estimate(variables.velocity).data());
  const auto bias = smoother_.Estimate(variables.bias);
  state.bias.accelerometer = Eigen::Map<const Eigen::Vector3d>(bias.data());
  state.bias.gyroscope = Eigen::Map<const Eigen::Vector3d>(bias.data() + 3);
  return state;
}

KeyframeGraph::Variables KeyframeGraph::AddVariables(const NavState& state) {
  const Eigen::Matrix<double, 6, 1> bias = BiasVector(state.bias);
  const VariableId pose = AddPose(state.T_world_body);
  return {.pose = pose,
          .velocity = smoother_.AddVariable({state.v_world_body.data(), 3}),
          .bias = smoother_.AddVariable({bias.data(), 6}),
          .map = pose};
}

VariableId KeyframeGraph::AddPose(const Pose3& pose) {
  double block[kPoseBlockSize];
  StorePose(pose, block);
  return smoother_.AddVariable(block, std::make_shared<PoseManifold>());
}

void KeyframeGraph::AddPrior(const OdometryEstimate& estimate, const Variables& at) {
  // Cross-correlations of the start are let go: the IMU factors restore what matters of them.
  const Eigen::Matrix3d velocity_covariance = estimate.covariance.block<3, 3>(kVelocity, kVelocity);
  // Position and yaw of the first keyframe define the world: a floor keeps the prior finite.
  const Matrix6d pose_covariance =
      Finite(PoseChartCovariance(estimate.state.T_world_body.R(), estimate.covariance));
  smoother_.AddFactor(std::make_shared<PosePriorFactor>(estimate.state.T_world_body,
                                                        SqrtInformationOf<6>(pose_covariance)),
                      nullptr, {at.pose});
  smoother_.AddFactor(std::make_shared<VectorPriorFactor>(
                          estimate.state.v_world_body, SqrtInformationOf<3>(velocity_covariance)),
                      nullptr, {at.velocity});
  AddBiasPrior(estimate, at);
}

void KeyframeGraph::AddBiasPrior(const OdometryEstimate& estimate, const Variables& at) {
  const Matrix6d covariance =
      estimate.covariance.block<6, 6>(kAccelerometerBias, kAccelerometerBias);
  smoother_.AddFactor(std::make_shared<VectorPriorFactor>(BiasVector(estimate.state.bias),
                                                          SqrtInformationOf<6>(covariance)),
                      nullptr, {at.bias});
}

// Roll and pitch by gravity. The residual of the prior is the rotation vector in the frame of the
// prior's body; its components along the world's x and y stay zero whatever the heading becomes.
void KeyframeGraph::AddTiltPrior(const OdometryEstimate& estimate, const Variables& at) {
  const Eigen::Matrix3d R = estimate.state.T_world_body.R();
  const Eigen::Matrix3d covariance =
      R * estimate.covariance.block<3, 3>(kRotation, kRotation) * R.transpose();
  const Eigen::Matrix2d tilt =
      covariance.topLeftCorner<2, 2>() + 1e-8 * Eigen::Matrix2d::Identity();
  Matrix6d W = Matrix6d::Zero();
  W.block<2, 3>(3, 3) = SqrtInformationOf<2>(tilt) * R.topRows<2>();
  smoother_.AddFactor(std::make_shared<PosePriorFactor>(estimate.state.T_world_body, W), nullptr,
                      {at.pose});
}

void KeyframeGraph::AddImuFactor(const Variables& from, const Variables& to,
                                 std::span<const ImuSample> imu, const ImuBias& bias) {
  smoother_.AddFactor(std::make_shared<ImuFactor>(Preintegrate(imu, bias, imu_), gravity_), nullptr,
                      {from.pose, from.velocity, from.bias, to.pose, to.velocity, to.bias});
}

void KeyframeGraph::AddMap(const OdometryEstimate& to, const NavState& guess, Variables& added) {
  if (!newest_->map || !to.map) return;
  added.map = AddPose(guess.T_world_body);
  AddMapStep(to, added.map);
  smoother_.AddFactor(
      std::make_shared<BetweenFactor>(Pose3(), SquareRoot<6>(to.degeneracy.information)), nullptr,
      {added.map, added.pose});
}

// Of the map's points the share s was seen from around the newest keyframe, X; the others lie as
// the map did there, M: a mixture of mean M + s (X - M) and covariance s (1 - s) Cov(X - M).
void KeyframeGraph::AddMapStep(const OdometryEstimate& to, VariableId map) {
  const Variables& from = variables_.back();
  const Pose3 T_from_to = newest_->state.T_world_body.inverse() * to.state.T_world_body;
  const double kept = std::exp(newest_->map->age - to.map->age);
  Vector6d bending;
  bending << Eigen::Vector3d::Constant(config_.map_position_sigma),
      Eigen::Vector3d::Constant(config_.map_rotation_sigma);
  Matrix6d covariance = kept * (1.0 - kept) * newest_->map->covariance;
  covariance.diagonal() += bending.cwiseAbs2();
  const Matrix6d W = SqrtInformationOf<6>(covariance);
  if (from.map == from.pose) {  // the map's beginning: all of it is X
    const Matrix6d W_to = W * AdjointSe3(T_from_to);
    smoother_.AddFactor(std::make_shared<BetweenFactor>(T_from_to, W_to), nullptr,
                        {from.pose, map});
  } else {
    smoother_.AddFactor(std::make_shared<MapStepFactor>(T_from_to, 1.0 - kept, W), nullptr,
                        {from.map, from.pose, map});
  }
}

void KeyframeGraph::AddVisualOdometryFactor(const MotionPrior& motion,
                                            const Variables& to_variables) {
  MLVI_CHECK(motion.from == newest_->state.stamp && motion.from < motion.to,
             "motion from {} to {}, keyframe at {}", ToString(motion.from), ToString(motion.to),
             ToString(newest_->state.stamp));
  smoother_.AddFactor(
      std::make_shared<BetweenFactor>(motion.T_from_to, SqrtInformationOf<6>(motion.covariance)),
      std::make_shared<ceres::CauchyLoss>(config_.visual_loss_scale),
      {variables_.back().pose, to_variables.pose});
}

Expected<GraphUpdate> KeyframeGraph::Solve() {
  const Expected<IncrementalSmootherSummary> solved = smoother_.Update();
  if (!solved) return tl::unexpected(solved.error());
  GraphUpdate update;
  update.keyframe = keyframes_.back().id;
  update.newest = Estimate(update.keyframe);
  update.covariance = Covariance(variables_.back());
  update.solver = *solved;
  return update;
}

Matrix15d KeyframeGraph::Covariance(const Variables& variables) const {
  // The smoother's order is pose chart (position in the body frame, rotation), velocity, bias.
  const Eigen::MatrixXd marginal = smoother_.MarginalCovariance(
      std::vector<VariableId>{variables.pose, variables.velocity, variables.bias});
  Matrix15d J = Matrix15d::Zero();
  J.block<3, 3>(kPosition, 0) = LoadPose(smoother_.Estimate(variables.pose).data()).R();
  J.block<3, 3>(kRotation, 3).setIdentity();
  J.block<3, 3>(kVelocity, 6).setIdentity();
  J.block<6, 6>(kAccelerometerBias, 9).setIdentity();
  return J * marginal * J.transpose();
}

}  // namespace mlvi

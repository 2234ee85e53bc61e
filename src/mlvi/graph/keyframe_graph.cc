// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/graph/keyframe_graph.h"

#include <ceres/loss_function.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "mlvi/factors/between_factor.h"
#include "mlvi/factors/imu_factor.h"
#include "mlvi/factors/map_step_factor.h"
#include "mlvi/factors/pose_block.h"
#include "mlvi/factors/prior_factor.h"
#include "mlvi/state/frame_change.h"

namespace mlvi {
namespace {

using nav_index::kAccelerometerBias;
using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

// An update leaves what exceeds a threshold of linearisation by less than the smoother's urgency to
// the next one; as each such step shrinks the rest, a handful of them settles what can settle.
constexpr int kSettlingSteps = 20;

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

// Information of a motion over a gap (pose chart). Nobody walks farther than some hundred metres
// unseen; kilometres beside what registrations and IMU tell of the next steps would drown in
// round-off, and the smoother would call all that follows undetermined.
Matrix6d GapInformation(const Matrix6d& covariance) {
  constexpr double kWidest = 500.0;  // m, one sigma
  Matrix6d information = Finite(covariance).inverse();
  information.diagonal().head<3>().array() += 1.0 / (kWidest * kWidest);
  return information;
}

// Whether `a` and `b` are worth a keyframe each.
bool AreApart(const NavState& a, const NavState& b, const GraphConfig& config) {
  const Vector6d step = BoxMinus(b.T_world_body, a.T_world_body);
  return step.head<3>().norm() >= config.keyframe_distance ||
         step.tail<3>().norm() >= config.keyframe_angle ||
         (b.stamp - a.stamp).seconds() >= config.keyframe_interval;
}

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
  return !newest_ || AreApart(newest_->state, state, config_);
}

// Of the states of a start those that become keyframes, ascending: the last, and each one far
// enough from the next.
std::vector<std::size_t> KeyframeGraph::KeyframesOf(std::span<const OdometryEstimate> start) const {
  std::vector<std::size_t> chosen = {start.size() - 1};
  for (std::size_t i = start.size() - 1; i-- > 0;) {
    if (AreApart(start[i].state, start[chosen.back()].state, config_)) chosen.push_back(i);
  }
  std::ranges::reverse(chosen);
  return chosen;
}

KeyframeGraph::Variables KeyframeGraph::AddStart(const EstimateBatch& start) {
  const std::span<const OdometryEstimate> estimates = start.estimates;
  MLVI_CHECK(!estimates.empty() && estimates.size() == start.clouds.size() &&
                 estimates.size() == start.relative.size() + 1,
             "a start of {} states, {} clouds, {} relative covariances", estimates.size(),
             start.clouds.size(), start.relative.size());
  const Pose3 T_guess_odometry = FrameOfGuess();
  std::vector<std::size_t> chosen = KeyframesOf(estimates);
  chosen.pop_back();
  std::vector<VariableId> earlier;
  for (const std::size_t i : chosen) {
    earlier.push_back(AddPose(T_guess_odometry * estimates[i].state.T_world_body));
    AddKeyframe(estimates[i], {.pose = earlier.back(), .velocity = {}, .bias = {}, .map = {}},
                start.clouds[i]);
  }
  const OdometryEstimate& last = estimates.back();
  const Variables at_last = AddVariables(InFrame(T_guess_odometry, last.state));
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const std::size_t i = chosen[k];
    const Pose3 T_last_k = last.state.T_world_body.inverse() * estimates[i].state.T_world_body;
    const Matrix6d W = SqrtInformationOf<6>(Finite(start.relative[i]));
    smoother_.AddFactor(std::make_shared<BetweenFactor>(T_last_k, W), nullptr,
                        {at_last.pose, earlier[k]});
  }
  AddKeyframe(last, at_last, start.clouds.back());
  return at_last;
}

Expected<GraphUpdate> KeyframeGraph::Begin(const EstimateBatch& start) {
  MLVI_CHECK(!newest_, "a graph of {} keyframes cannot begin", keyframes_.size());
  const Variables added = AddStart(start);
  AddPrior(start.estimates.back(), added);
  return Commit(0, start.estimates.back());
}

Expected<GraphUpdate> KeyframeGraph::Add(const OdometryEstimate& estimate,
                                         std::shared_ptr<const PointCloud> points,
                                         std::span<const ImuSample> imu,
                                         const std::optional<MotionPrior>& visual) {
  MLVI_CHECK(newest_.has_value(), "an estimate at {} without a keyframe before it",
             ToString(estimate.state.stamp));
  const std::size_t before = keyframes_.size();
  const NavState guess = InFrame(FrameOfGuess(), estimate.state);
  Variables added = AddVariables(guess);
  AddImuFactor(variables_.back(), added, imu, newest_->state.bias);
  AddMap(estimate, guess, added);
  if (visual) AddVisualOdometryFactor(*visual, added);
  AddKeyframe(estimate, added, std::move(points));
  return Commit(before, estimate);
}

Expected<GraphUpdate> KeyframeGraph::BeginAfterGap(const EstimateBatch& start,
                                                   const Matrix6d& gap) {
  MLVI_CHECK(newest_.has_value(), "a gap without a keyframe before it");
  const std::size_t before = keyframes_.size();
  const Variables from = variables_.back();
  const Variables added = AddStart(start);
  const OdometryEstimate& last = start.estimates.back();
  const Pose3 T_from_to = newest_->state.T_world_body.inverse() * last.state.T_world_body;
  smoother_.AddFactor(std::make_shared<BetweenFactor>(T_from_to, SquareRoot(GapInformation(gap))),
                      nullptr, {from.pose, added.pose});
  AddTiltPrior(last, added);
  // Three times the speed: less would tell the heading, against which the speed is measured.
  const NavState guess = InFrame(FrameOfGuess(), last.state);
  const Eigen::Matrix3d any_heading =
      9.0 * guess.v_world_body.squaredNorm() * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d velocity_covariance =
      last.covariance.block<3, 3>(kVelocity, kVelocity) + any_heading;
  smoother_.AddFactor(std::make_shared<VectorPriorFactor>(
                          guess.v_world_body, SqrtInformationOf<3>(velocity_covariance)),
                      nullptr, {added.velocity});
  AddBiasPrior(last, added);
  return Commit(before, last);
}

Pose3 KeyframeGraph::FrameOfGuess() const {
  if (!newest_) return Pose3();
  return update_->newest.T_world_body * newest_->state.T_world_body.inverse();
}

void KeyframeGraph::AddKeyframe(const OdometryEstimate& estimate, const Variables& variables,
                                std::shared_ptr<const PointCloud> points) {
  const KeyframeId id(static_cast<std::int64_t>(keyframes_.size()));
  keyframes_.push_back({.id = id, .state = estimate.state, .points = std::move(points)});
  variables_.push_back(variables);
}

Expected<GraphUpdate> KeyframeGraph::Commit(std::size_t before, const OdometryEstimate& newest) {
  const NavState guess = InFrame(FrameOfGuess(), newest.state);
  Expected<GraphUpdate> update = Solve();
  if (!update) {
    smoother_.DiscardPending();
    keyframes_.resize(before);
    variables_.resize(before);
    return update;
  }
  newest_ = newest;
  update_->largest_position_change =
      (update->newest.T_world_body.translation() - guess.T_world_body.translation()).norm();
  return *update_;
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
  const Pose3 before = update_->newest.T_world_body;
  if (const Expected<GraphUpdate> update = Solve(); !update) {
    smoother_.DiscardPending();
    return update;
  }
  ++loops_;
  (void)Settle();  // where it fails, the loop stands as solved, and converged() tells
  update_->largest_position_change =
      (update_->newest.T_world_body.translation() - before.translation()).norm();
  return *update_;
}

Expected<GraphUpdate> KeyframeGraph::Settle() {
  MLVI_CHECK(update_.has_value(), "nothing to settle before the first keyframe");
  Expected<IncrementalSmootherSummary> solved = update_->solver;
  IncrementalSmootherSummary solver = *solved;
  for (int step = 0; step < kSettlingSteps && solved && solver.stale_variables > 0; ++step) {
    solved = smoother_.Update();
    if (solved) solver = *solved;
  }
  const GraphUpdate update = Updated(solver);  // of the steps that succeeded, whatever came then
  if (!solved) return tl::unexpected(solved.error());
  return update;
}

NavState KeyframeGraph::Estimate(KeyframeId id) const {
  MLVI_CHECK(id.valid() && id.value() < static_cast<std::int64_t>(variables_.size()),
             "keyframe {} of {}", id.value(), variables_.size());
  const auto index = static_cast<std::size_t>(id.value());
  const Variables& variables = variables_[index];
  NavState state;
  const NavState& odometry = keyframes_[index].state;
  const Pose3 T_world_body = LoadPose(smoother_.Estimate(variables.pose).data());
  if (!variables.velocity.valid())
    return InFrame(T_world_body * odometry.T_world_body.inverse(), odometry);
  state.stamp = odometry.stamp;
  state.T_world_body = T_world_body;
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
  // In the order of the factor: pose chart (position in the body frame), velocity, biases.
  Matrix15d J = Matrix15d::Zero();
  J.block<3, 3>(0, kPosition) = estimate.state.T_world_body.R().transpose();
  J.block<3, 3>(3, kRotation).setIdentity();
  J.block<3, 3>(6, kVelocity).setIdentity();
  J.block<6, 6>(9, kAccelerometerBias).setIdentity();
  Matrix15d covariance = J * estimate.covariance * J.transpose();
  // Where the pose defines the world it has no error: a floor keeps the prior finite.
  covariance.topLeftCorner<6, 6>() = Finite(covariance.topLeftCorner<6, 6>());
  smoother_.AddFactor(
      std::make_shared<NavPriorFactor>(estimate.state, SqrtInformationOf<15>(covariance)), nullptr,
      {at.pose, at.velocity, at.bias});
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
// the map did there, M: a mixture of mean M + s (X - M) and covariance s (1 - s) Cov(X - M). The
// map of a start is named after its last state: there is no M to hang on, and all of Cov(X - M)
// counts.
void KeyframeGraph::AddMapStep(const OdometryEstimate& to, VariableId map) {
  const Variables& from = variables_.back();
  const Pose3 T_from_to = newest_->state.T_world_body.inverse() * to.state.T_world_body;
  const double kept = std::exp(newest_->map->age - to.map->age);
  Vector6d bending;
  bending << Eigen::Vector3d::Constant(config_.map_position_sigma),
      Eigen::Vector3d::Constant(config_.map_rotation_sigma);
  const bool begins = from.map == from.pose;
  Matrix6d covariance = (begins ? 1.0 : kept * (1.0 - kept)) * newest_->map->covariance;
  covariance.diagonal() += bending.cwiseAbs2();
  const Matrix6d W = SqrtInformationOf<6>(covariance);
  if (begins) {
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
  return Updated(*solved);
}

GraphUpdate KeyframeGraph::Updated(const IncrementalSmootherSummary& solver) {
  GraphUpdate update;
  update.keyframe = keyframes_.back().id;
  update.newest = Estimate(update.keyframe);
  update.covariance = Covariance(variables_.back());
  update.solver = solver;
  update_ = update;
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

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/start.h"

#include <Eigen/LU>
#include <algorithm>

#include "mlvi/imu/preintegration.h"
#include "mlvi/imu/propagation.h"
#include "mlvi/lio/normal_equations.h"

namespace mlvi {
namespace {

// One sigma that the registered steps cannot undercut: the map is a single sweep old, its errors
// are shared.
constexpr double kStepSigmaM = 0.01;
constexpr double kStepSigmaRad = 0.002;
// Error of a sweep's registered rotation at rest, where all sweeps see the same surfaces.
constexpr double kTurnSigmaRad = 0.001;
constexpr double kRestSigmaM = 0.005;  // and of its position
constexpr double kSeen = 4.0;          // sigmas of three components: beyond, a motion is believed
// Gyroscope bias and scale before they are known, as a share of the interval and of the angle
// turned.
constexpr double kGyroscopeScale = 0.02;

Matrix6d StepCovariance(const StateEstimate& estimate) {
  Matrix6d covariance = PoseChartCovariance(estimate.mean.nav.T_world_body.R(),
                                            estimate.covariance.topLeftCorner<15, 15>());
  covariance.diagonal().head<3>().array() += kStepSigmaM * kStepSigmaM;
  covariance.diagonal().tail<3>().array() += kStepSigmaRad * kStepSigmaRad;
  return covariance;
}

// As the start reports it: errors of the small map are common to all its sweeps.
Degeneracy Capped(Degeneracy degeneracy) {
  Vector6d unused = Vector6d::Zero();
  AddCommonError(StartInformation().inverse(), degeneracy.information, unused);
  return degeneracy;
}

Degeneracy Turned(const Eigen::Matrix3d& R, Degeneracy degeneracy) {
  degeneracy.translation_axes = R * degeneracy.translation_axes;
  degeneracy.rotation_axes = R * degeneracy.rotation_axes;
  return degeneracy;
}

FilterMatrix GuessCovariance(double dt, double angle, double speed_sigma, const ImuSpec& imu) {
  FilterMatrix P = FilterMatrix::Zero();
  const double position = speed_sigma * dt + 0.02;
  const double rotation = imu.initial_gyroscope_bias_sigma * dt + kGyroscopeScale * angle + 0.002;
  P.diagonal().segment<3>(nav_index::kPosition).setConstant(position * position);
  P.diagonal().segment<3>(nav_index::kRotation).setConstant(rotation * rotation);
  return P;
}

}  // namespace

Matrix6d StartInformation() {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(kStepSigmaM), Eigen::Vector3d::Constant(kStepSigmaRad);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

StartResult InWorld(const Pose3& T_world_level, StartResult start) {
  const Eigen::Matrix3d R = T_world_level.R();
  for (NavState& state : start.states) {
    state.T_world_body = T_world_level * state.T_world_body;
    state.v_world_body = R * state.v_world_body;
  }
  for (Degeneracy& degeneracy : start.degeneracies) degeneracy = Turned(R, degeneracy);
  Matrix15d turn = Matrix15d::Identity();
  turn.block<3, 3>(nav_index::kPosition, nav_index::kPosition) = R;
  turn.block<3, 3>(nav_index::kVelocity, nav_index::kVelocity) = R;
  start.covariance = turn * start.covariance * turn.transpose();
  start.T_world_first = T_world_level * start.T_world_first;
  return start;
}

std::vector<NavState> GyroTrajectory(const NavState& anchor, std::span<const ImuSample> samples) {
  std::vector<NavState> states(samples.size(), anchor);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    states[i].stamp = samples[i].stamp;
    if (i == 0) continue;
    const double dt = (samples[i].stamp - samples[i - 1].stamp).seconds();
    const Eigen::Vector3d rate =
        0.5 * (samples[i].angular_velocity + samples[i - 1].angular_velocity) -
        anchor.bias.gyroscope;
    states[i].T_world_body = states[i - 1].T_world_body * Pose3(ExpSo3(rate * dt), {0.0, 0.0, 0.0});
  }
  // Until here the anchor's attitude is that of the first sample.
  const Eigen::Quaterniond& R_anchor = anchor.T_world_body.rotation();
  const Eigen::Quaterniond turn =
      R_anchor * InterpolatePose(states, anchor.stamp).rotation().conjugate();
  for (NavState& state : states) {
    const double dt = (state.stamp - anchor.stamp).seconds();
    state.T_world_body = Pose3(turn * state.T_world_body.rotation(),
                               anchor.T_world_body.translation() + dt * anchor.v_world_body);
  }
  return states;
}

Start::Start(const LioConfig& config, const Rig& rig)
    : config_(config), rig_(rig), map_(config.map) {}

std::optional<StartResult> Start::Add(const LidarSweep& sweep, std::span<const ImuSample> imu) {
  for (const ImuSample& sample : imu) {
    if (imu_.empty() || sample.stamp > imu_.back().stamp) imu_.push_back(sample);
  }
  if (!kept_.empty() && (sweep.end() - newest_end()).seconds() > config_.start.max_span) {
    BeginAnew();
  }
  kept_.push_back(Registered(sweep));
  if (kept_.size() == 2) {
    // The first sweep was deskewed without a velocity; now there is one.
    velocity_ = LastVelocity();
    RebuildMap();
    kept_.pop_back();
    kept_.push_back(Registered(sweep));
  }
  if (kept_.size() >= 2) velocity_ = LastVelocity();
  map_.Insert(kept_.back().features, kept_.back().T_start_body);
  if (auto result = AtRest() ? TryStatic() : TryMoving()) return result;
  while (Span() > config_.start.max_span) DropOldest();
  return std::nullopt;
}

void Start::BeginAnew() {
  kept_.clear();
  map_.Clear();
  velocity_.setZero();
}

Start::Kept Start::Registered(const LidarSweep& sweep) const {
  const bool first = kept_.empty();
  const Time from = first ? sweep.end() : kept_.back().sweep.end();
  const Pose3 start = first ? Pose3() : kept_.back().T_start_body;
  std::vector<ImuSample> samples = SamplesBetween(imu_, std::min(from, sweep.stamp), sweep.end());
  if (samples.empty()) samples.push_back({.stamp = sweep.end()});
  const std::vector<NavState> trajectory = GyroTrajectory(
      {.stamp = from, .T_world_body = start, .v_world_body = velocity_, .bias = {}}, samples);
  const DeskewedSweep deskewed = Deskew(sweep, trajectory, *rig_.lidar);
  Kept kept{.sweep = sweep,
            .T_start_body = Pose3(),
            .covariance = Matrix6d::Identity() * 1e-6,
            .features = ExtractFeatures(deskewed, sweep, *rig_.lidar, config_),
            .degeneracy = {.information = StartInformation()}};
  if (first) return kept;
  const double dt = (sweep.end() - from).seconds();
  const double angle =
      LogSo3(start.rotation().conjugate() * trajectory.back().T_world_body.rotation()).norm();
  // The speed is a guess until two sweeps are there, then it changes by acceleration.
  const double speed_sigma =
      kept_.size() < 2 ? config_.start.max_speed : std::min(config_.start.max_speed, 4.0 * dt);
  const StateEstimate prior{{.nav = trajectory.back()},
                            GuessCovariance(dt, angle, speed_sigma, rig_.imu)};
  RegistrationConfig registration = config_.registration;
  registration.max_iterations = 3 * registration.max_iterations;
  const RegistrationResult result =
      Register(kept.features, map_, prior, *rig_.lidar, {}, registration, config_.degeneracy);
  kept.T_start_body = result.estimate.mean.nav.T_world_body;
  kept.covariance = StepCovariance(result.estimate);
  kept.degeneracy = Capped(result.degeneracy);
  return kept;
}

void Start::RebuildMap() {
  map_.Clear();
  Kept& first = kept_.front();
  const std::vector<ImuSample> samples = SamplesBetween(imu_, first.sweep.stamp, first.sweep.end());
  if (!samples.empty()) {
    // The start frame is the body at the end of this sweep.
    const auto trajectory = GyroTrajectory({.stamp = first.sweep.end(),
                                            .T_world_body = first.T_start_body,
                                            .v_world_body = velocity_,
                                            .bias = {}},
                                           samples);
    first.features = ExtractFeatures(Deskew(first.sweep, trajectory, *rig_.lidar), first.sweep,
                                     *rig_.lidar, config_);
  }
  map_.Insert(first.features, first.T_start_body);
}

void Start::DropOldest() {
  kept_.pop_front();
  const Time needed = kept_.front().sweep.stamp;
  const auto keep =
      std::lower_bound(imu_.begin(), imu_.end(), needed,
                       [](const ImuSample& sample, Time t) { return sample.stamp < t; });
  if (keep != imu_.begin()) imu_.erase(imu_.begin(), keep - 1);
}

bool Start::AtRest() const {
  for (const Kept& kept : kept_) {
    const Pose3 motion = kept_.front().T_start_body.inverse() * kept.T_start_body;
    if (motion.translation().norm() > config_.start.rest_distance) return false;
    if (LogSo3(motion.rotation()).norm() > config_.start.rest_angle) return false;
  }
  return true;
}

// Nobody stands perfectly still. The specific force is that of the mean attitude, unless it is
// taken to the last one by the turn that the sweeps show.
std::optional<Initialization> Start::LevelAtRest() {
  const Time end = kept_.back().sweep.end();
  std::vector<ImuSample> samples = SamplesBetween(imu_, kept_.front().sweep.end(), end);
  if (TellsTurn() && TurnRate().norm() > kSeen * TurnRateSigma()) {
    for (ImuSample& sample : samples) {
      const double dt = (sample.stamp - end).seconds();
      sample.linear_acceleration = ExpSo3(TurnRate() * dt) * sample.linear_acceleration;
    }
  }
  return InitializeAtRest(samples, rig_.imu, rig_.gravity, &why_);
}

// A slow turn that the sweeps show is not a bias of the gyroscope, and to the IMU a smooth drive
// looks like rest. Where the surroundings do not tell the turn, the registered one is the
// gyroscopes' own.
void Start::AddSlowMotion(NavState& last, Matrix15d& covariance) const {
  if (TellsTurn()) {
    last.bias.gyroscope -= TurnRate();
    covariance.diagonal().segment<3>(nav_index::kGyroscopeBias).array() +=
        std::pow(TurnRateSigma(), 2);
  }
  const double sigma = std::sqrt(2.0) * kRestSigmaM / Span();
  const Eigen::Vector3d velocity =
      (kept_.back().T_start_body.translation() - kept_.front().T_start_body.translation()) / Span();
  if (TellsPlace() && velocity.norm() > kSeen * sigma) {
    const Eigen::Quaterniond R_world_start =
        last.T_world_body.rotation() * kept_.back().T_start_body.rotation().conjugate();
    last.v_world_body = R_world_start * velocity;
    covariance.diagonal().segment<3>(nav_index::kVelocity).array() += sigma * sigma;
  }
}

std::optional<StartResult> Start::TryStatic() {
  if (kept_.size() < 2) {
    why_ = "one sweep alone cannot tell rest from motion";
    return std::nullopt;
  }
  const auto at_rest = LevelAtRest();
  if (!at_rest || at_rest->states.empty()) return TryMoving();
  StartResult result{.states = {},
                     .covariance = at_rest->covariance,
                     .relative = RelativeAtRest(),
                     .sweeps = {},
                     .degeneracies = {},
                     .method = "static",
                     .T_world_first = {}};
  NavState state = at_rest->states.back();
  AddSlowMotion(state, result.covariance);
  const Pose3 T_world_start = state.T_world_body * kept_.back().T_start_body.inverse();
  result.T_world_first = T_world_start;
  for (const Kept& kept : kept_) {
    state.stamp = kept.sweep.end();
    state.T_world_body = T_world_start * kept.T_start_body;
    result.states.push_back(state);
  }
  AddSweeps(T_world_start.R(), result);
  return result;
}

// Covariance of a registered pose: what the sweep does not tell is bounded by what counts as rest.
Matrix6d Start::RegisteredAtRest(const Kept& kept) const {
  Vector6d rest;
  rest << Eigen::Vector3d::Constant(config_.start.rest_distance),
      Eigen::Vector3d::Constant(config_.start.rest_angle);
  Matrix6d information = kept.degeneracy.information;
  information.diagonal() += rest.cwiseAbs2().cwiseInverse();
  return information.inverse();
}

// Sweeps are registered to the first, which has no error of its own; errors of the others are
// independent.
std::vector<Matrix6d> Start::RelativeAtRest() const {
  const Matrix6d of_last = RegisteredAtRest(kept_.back());
  std::vector<Matrix6d> relative;
  for (const Kept& kept : kept_) relative.push_back(RegisteredAtRest(kept) + of_last);
  relative.front() = of_last;
  relative.back().setZero();
  return relative;
}

void Start::AddSweeps(const Eigen::Matrix3d& R_world_start, StartResult& result) const {
  for (const Kept& kept : kept_) {
    result.sweeps.push_back(kept.sweep);
    result.degeneracies.push_back(Turned(R_world_start, kept.degeneracy));
  }
}

bool Start::TellsTurn() const {
  return Span() > 0.0 && std::none_of(kept_.begin(), kept_.end(), [](const Kept& kept) {
           return kept.degeneracy.rotation_directions > 0;
         });
}

bool Start::TellsPlace() const {
  return Span() > 0.0 && std::none_of(kept_.begin(), kept_.end(), [](const Kept& kept) {
           return kept.degeneracy.translation_directions > 0;
         });
}

double Start::Span() const {
  return (kept_.back().sweep.end() - kept_.front().sweep.end()).seconds();
}

Eigen::Vector3d Start::LastVelocity() const {
  const Kept& a = kept_[kept_.size() - 2];
  const Kept& b = kept_.back();
  return (b.T_start_body.translation() - a.T_start_body.translation()) /
         std::max(1e-3, (b.sweep.end() - a.sweep.end()).seconds());
}

Eigen::Vector3d Start::TurnRate() const {
  return LogSo3(kept_.front().T_start_body.rotation().conjugate() *
                kept_.back().T_start_body.rotation()) /
         Span();
}

double Start::TurnRateSigma() const { return std::sqrt(2.0) * kTurnSigmaRad / Span(); }

std::optional<StartResult> Start::TryMoving() {
  const double span = Span();
  if (static_cast<int>(kept_.size()) < config_.start.min_sweeps || span < config_.start.min_span) {
    why_ = fmt::format("a moving start needs {} sweeps over {:.1f} s, has {} over {:.1f} s",
                       config_.start.min_sweeps, config_.start.min_span, kept_.size(), span);
    return std::nullopt;
  }
  std::vector<TimedPose> poses;
  for (const Kept& kept : kept_) {
    poses.push_back({.stamp = kept.sweep.end(),
                     .T_start_body = kept.T_start_body,
                     .covariance = kept.covariance});
  }
  auto initialization = InitializeFromPoses(poses, imu_, rig_.imu, rig_.gravity);
  if (!initialization) {
    why_ = initialization.error().message;
    return std::nullopt;
  }
  StartResult result{.states = std::move(initialization->states),
                     .covariance = initialization->covariance,
                     .relative = std::move(initialization->relative),
                     .sweeps = {},
                     .degeneracies = {},
                     .method = initialization->method,
                     .T_world_first = {}};
  result.T_world_first = result.states.front().T_world_body * kept_.front().T_start_body.inverse();
  AddSweeps(result.T_world_first.R(), result);
  return result;
}

}  // namespace mlvi

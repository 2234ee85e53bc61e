// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/lio.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/imu/preintegration.h"
#include "mlvi/lio/deskew.h"
#include "mlvi/lio/features.h"
#include "mlvi/lio/imu_gap.h"
#include "mlvi/lio/motion_guess.h"
#include "mlvi/lio/placement.h"
#include "mlvi/lio/registration.h"
#include "mlvi/lio/start.h"

namespace mlvi {

namespace {

// Older samples are forgotten, needed or not: an estimate that does not move on must not fill
// memory. Longer than any start, whose own sweeps span at most start.max_span.
Duration ImuMemory(const LioConfig& config) {
  return Duration::FromSeconds(std::max(60.0, 2.0 * config.start.max_span));
}

// Of the points offered, those that found a place in the map.
double Share(const RegistrationResult& registration) {
  return static_cast<double>(registration.correspondences) / std::max(registration.offered, 1);
}

bool FitsWorse(const RegistrationResult& registration, double usual_share) {
  constexpr double kBad = 0.6;
  return Share(registration) < kBad * usual_share;
}

// The LiDAR's time offset stays within so many sigmas of the rig's.
constexpr double kMostOffsetSigmas = 10.0;
// Keeps MapTie::age finite: even the first sweep counts as not quite all of the map.
constexpr double kMostReplaced = 0.99;

bool IsFinite(const StateEstimate& estimate) {
  return BoxMinus(estimate.mean, FilterState()).allFinite() && estimate.covariance.allFinite();
}

void Note(const RegistrationResult& registration, LioResult& result) {
  result.correspondences = registration.correspondences;
  result.iterations = registration.iterations;
  result.rms_residual = registration.rms_residual;
  result.converged = registration.converged;
}

std::vector<ImuSample> Restamped(std::span<const ImuSample> samples, Duration later) {
  std::vector<ImuSample> result(samples.begin(), samples.end());
  for (ImuSample& sample : result) sample.stamp = sample.stamp + later;
  return result;
}

LioResult Figures(const RegistrationResult& registration, LioResult::Status status) {
  LioResult result;
  result.status = status;
  Note(registration, result);
  return result;
}

}  // namespace

struct Lio::Impl {
  Impl(const LioConfig& c, const Rig& r, StageTimes& t)
      : config(c), rig(r), times(t), map(config.map, config.marks) {
    MLVI_CHECK(rig.lidar.has_value(), "rig \"{}\" has no LiDAR", rig.name);
    start.emplace(config, rig);
    estimate.covariance(kTimeOffset, kTimeOffset) = c.time_offset_sigma * c.time_offset_sigma;
  }

  std::optional<LioResult> Rejection(const LidarSweep& sweep) const;
  void Remember(std::span<const ImuSample> samples);
  void Forget(Time before);
  Time OnImuClock(Time lidar) const {
    return lidar + Duration::FromSeconds(estimate.mean.time_offset);
  }
  std::vector<ImuSample> ImuOnLidarClock() const;
  LioResult Begin(const LidarSweep& sweep);
  void TakeStart(const StartResult& first, LioResult& result);
  SweepFeatures TakeState(std::size_t i, const StartResult& first, LioResult& result);
  Matrix6d WorldError(const Pose3& T_world_body) const;
  StateEstimate InTheirMap(const SweepFeatures& last, const StateEstimate& anchored,
                           LioResult& figures);
  double SilentTimeUntil(Time end) const;
  Prediction PredictTo(const LidarSweep& sweep) const;
  DeskewedSweep TimedDeskew(const LidarSweep& sweep, std::span<const NavState> trajectory);
  SweepFeatures TimedFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                              const Pose3& T_world_body, const StateEstimate& prior);
  RegistrationResult TimedRegister(const SweepFeatures& features, const StateEstimate& prior);
  void Accept(const StateEstimate& estimate);
  double Insert(const SweepFeatures& features, const Pose3& T_world_body);
  Matrix6d PoseInMap() const;
  OdometryEstimate Reported(const RegistrationResult& registration, double age) const;
  LioResult Track(const SweepFeatures& features, const RegistrationResult& registration,
                  double silent);
  void JudgeFit(const RegistrationResult& registration, double silent);
  bool Overdue(Time now) const { return (now - last_registered).seconds() >= config.lost_after; }
  bool BeyondSearch(const StateEstimate& prior) const;
  bool Found(const RegistrationResult& registration, Time now) const;
  LioResult Lose(const LidarSweep& sweep, const RegistrationResult& registration,
                 const StateEstimate& prior, double silent);
  LioResult GiveUp(const LidarSweep& sweep, const StateEstimate& prior, double silent,
                   const std::string& why);

  LioConfig config;
  Rig rig;
  StageTimes& times;
  std::vector<ImuSample> imu;          // from the instant of `estimate` on, or all of the start
  std::optional<Start> start;          // while initialising
  std::optional<Placement> placement;  // of a start after a loss
  StateEstimate estimate;
  std::optional<Eigen::Vector3d> lone_axis;  // of the last registration (FindDegeneracy)
  Matrix6d drift = Matrix6d::Zero();  // covariance of the map's own error at the pose of `estimate`
  LocalMap map;
  double map_age = 0.0;  // MapTie
  Time last_registered;  // by a registration that converged
  // After a silence of the IMU: sweeps for which a bad fit means a wrong pose, and the share of
  // points that fit before.
  int recovering = 0;
  bool fits_badly = false;
  double usual_share = 0.0;
};

Lio::Lio(const LioConfig& config, const Rig& rig, StageTimes& times)
    : impl_(std::make_unique<Impl>(config, rig, times)) {}
Lio::~Lio() = default;

std::size_t Lio::imu_samples() const { return impl_->imu.size(); }

LioResult Lio::Process(const LidarSweep& sweep, std::span<const ImuSample> imu,
                       const std::optional<MotionPrior>& guess) {
  const StageTimes::Scope timer(impl_->times, "lio/total");
  impl_->Remember(imu);
  if (const auto rejection = impl_->Rejection(sweep)) return *rejection;
  if (impl_->start) return impl_->Begin(sweep);

  const double silent = impl_->SilentTimeUntil(sweep.end());
  const Prediction prediction = impl_->PredictTo(sweep);
  const StateEstimate prior =
      guess ? FuseMotionGuess(impl_->estimate, prediction, *guess) : prediction.end;
  if (impl_->Overdue(sweep.end()) && impl_->BeyondSearch(prior)) {
    return impl_->GiveUp(sweep, prior, silent, "");
  }
  std::vector<NavState> trajectory = Bent(prediction.trajectory, prior.mean.nav.T_world_body);
  SweepFeatures features;
  RegistrationResult registration;
  for (int pass = 0; pass < (silent > 0.0 ? impl_->config.gap.passes : 1); ++pass) {
    const DeskewedSweep deskewed = impl_->TimedDeskew(sweep, trajectory);
    features = impl_->TimedFeatures(deskewed, sweep, trajectory.back().T_world_body, prior);
    registration = impl_->TimedRegister(features, prior);
    trajectory = Bent(trajectory, registration.estimate.mean.nav.T_world_body);
  }
  if (!impl_->Found(registration, sweep.end())) {
    return impl_->Lose(sweep, registration, prior, silent);
  }
  return impl_->Track(features, registration, silent);
}

std::optional<LioResult> Lio::Impl::Rejection(const LidarSweep& sweep) const {
  LioResult result;
  result.status = LioResult::Status::kRejected;
  const Time last = start ? start->newest_end() : estimate.mean.nav.stamp;
  if (sweep.points.empty()) {
    result.rejection = "empty sweep";
    result.reason = fmt::format("the sweep at {} has no points: driver hiccup or covered sensor",
                                ToString(sweep.stamp));
  } else if (static_cast<int>(sweep.points.size()) < config.min_points) {
    result.rejection = "too few points";
    result.reason = fmt::format("the sweep at {} has {} points, fewer than lio.min_points = {}",
                                ToString(sweep.stamp), sweep.points.size(), config.min_points);
  } else if (last.valid() && sweep.end() <= last) {
    result.rejection = "out of order";
    result.reason = fmt::format("the sweep ends at {}, not after the last estimate at {}",
                                ToString(sweep.end()), ToString(last));
  } else if (imu.empty() || imu.back().stamp + Duration::FromSeconds(config.gap.max_silence) <
                                OnImuClock(sweep.end())) {
    result.rejection = "IMU missing";
    result.reason = fmt::format(
        "the newest IMU sample ({}) is too old for the sweep {} .. {}: check the IMU topic and its "
        "time offset",
        imu.empty() ? "none" : ToString(imu.back().stamp), ToString(sweep.stamp),
        ToString(sweep.end()));
  } else {
    return std::nullopt;
  }
  return result;
}

void Lio::Impl::Remember(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples) {
    if (imu.empty() || sample.stamp > imu.back().stamp) imu.push_back(sample);
  }
  if (!imu.empty()) Forget(imu.back().stamp - ImuMemory(config));
}

void Lio::Impl::Forget(Time before) {
  // The last sample before stays: interpolation at that instant needs it.
  const auto first =
      std::upper_bound(imu.begin(), imu.end(), before,
                       [](Time t, const ImuSample& sample) { return t < sample.stamp; });
  if (first != imu.begin()) imu.erase(imu.begin(), first - 1);
}

// What is known of the time offset outlives a loss of track.
std::vector<ImuSample> Lio::Impl::ImuOnLidarClock() const {
  return Restamped(imu, -Duration::FromSeconds(estimate.mean.time_offset));
}

LioResult Lio::Impl::Begin(const LidarSweep& sweep) {
  const StageTimes::Scope timer(times, "lio/start");
  LioResult result;
  const std::optional<StartResult> first = start->Add(sweep, ImuOnLidarClock());
  result.reason = start->why();
  if (!first) return result;
  result.status = LioResult::Status::kTracking;
  result.reason = fmt::format("{} start from {} sweeps", first->method, first->sweeps.size());
  if (placement) {
    const Pose3 T_world_level = WorldOfStart(first->T_world_first, placement->T_world_body);
    TakeStart(InWorld(T_world_level, *first), result);
  } else {
    TakeStart(*first, result);
  }
  return result;
}

void Lio::Impl::TakeStart(const StartResult& first, LioResult& result) {
  SweepFeatures features;
  for (std::size_t i = 0; i < first.sweeps.size(); ++i) {
    features = TakeState(i, first, result);
    if (i + 1 == first.sweeps.size()) break;
    result.new_share = Insert(features, first.states[i].T_world_body);
    result.relative.push_back(first.relative[i]);
  }
  // The world is where this pose says, however well it fits the map.
  const Pose3& T_world_last = first.states.back().T_world_body;
  const Matrix6d error = WorldError(T_world_last);
  if (placement) {
    Matrix15d unknown = first.covariance;
    AddPoseCovariance(PlacementError(*placement, T_world_last), unknown);
    result.gap = PoseChartCovariance(T_world_last.R(), unknown);
  }
  const StateEstimate anchored =
      AnchorToMap(first.states.back(), first.covariance, TimeOffsetOf(estimate));
  features.deskew = DeskewErrorOf(anchored, first.sweeps.back().span, rig.imu.noise);
  Accept(InTheirMap(features, anchored, result));
  result.time_offset = TimeOffsetOf(estimate);
  OdometryEstimate& last = result.estimates.back();
  last.map = MapTie{.covariance = PoseInMap(), .age = map_age};
  Insert(features, estimate.mean.nav.T_world_body);
  last.state = estimate.mean.nav;
  last.covariance = ReportedCovariance(estimate, error);
  // Poses to come are told by the map, which lies in the world as well as this pose in it.
  drift = PoseCovariance(estimate.covariance) + error;
  last_registered = estimate.mean.nav.stamp;
  start.reset();
  placement.reset();
}

// Reports a state of the start as the start saw it. Returns the features of its sweep.
SweepFeatures Lio::Impl::TakeState(std::size_t i, const StartResult& first, LioResult& result) {
  const LidarSweep& kept = first.sweeps[i];
  const NavState& state = first.states[i];
  const auto samples = SamplesBetween(ImuOnLidarClock(), kept.stamp, kept.end());
  const auto trajectory =
      samples.empty() ? std::vector<NavState>{state} : GyroTrajectory(state, samples);
  SweepFeatures features =
      ExtractFeatures(Deskew(kept, trajectory, *rig.lidar), kept, *rig.lidar, config);
  OdometryEstimate reported{.state = state,
                            .covariance = first.covariance,
                            .degeneracy = first.degeneracies[i],
                            .map = std::nullopt};
  AddPoseCovariance(WorldError(state.T_world_body), reported.covariance);
  result.estimates.push_back(std::move(reported));
  result.clouds.push_back(std::make_shared<PointCloud>(features.cloud));
  return features;
}

// What a start after a loss does not know of its place in the world: the drift until then and the
// way since. A first start defines the world.
Matrix6d Lio::Impl::WorldError(const Pose3& T_world_body) const {
  if (!placement) return Matrix6d::Zero();
  const StateEstimate there{.mean = {.nav = {.T_world_body = T_world_body}}};
  return GrownDrift(drift, estimate.mean.nav.T_world_body, there, 0.0) +
         PlacementError(*placement, T_world_body);
}

// The poses of the start were found one by one in a growing map, to 5 mm; in the map of the
// others the last one is known as well as later ones.
StateEstimate Lio::Impl::InTheirMap(const SweepFeatures& last, const StateEstimate& anchored,
                                    LioResult& figures) {
  const RegistrationResult registration = TimedRegister(last, anchored);
  Note(registration, figures);
  const bool found = registration.converged &&
                     registration.correspondences >= config.registration.min_correspondences;
  return found ? registration.estimate : anchored;
}

double Lio::Impl::SilentTimeUntil(Time end) const {
  return SilentTime(ImuOnLidarClock(), estimate.mean.nav.stamp, end, rig.imu.rate_hz);
}

Prediction Lio::Impl::PredictTo(const LidarSweep& sweep) const {
  const std::vector<ImuSample> samples =
      SamplesBetween(ImuOnLidarClock(), estimate.mean.nav.stamp, sweep.end());
  Prediction prediction = Predict(estimate, samples, rig.imu, rig.gravity);
  // A bad fit after a silence says nothing about the pose: the next sweep searches widely as well.
  const double unwatched = (sweep.end() - estimate.mean.nav.stamp).seconds();
  if (fits_badly) AddGapUncertainty(prediction.end, unwatched, config.gap);
  return prediction;
}

DeskewedSweep Lio::Impl::TimedDeskew(const LidarSweep& sweep,
                                     std::span<const NavState> trajectory) {
  const StageTimes::Scope timer(times, "lio/deskew");
  return Deskew(sweep, trajectory, *rig.lidar);
}

SweepFeatures Lio::Impl::TimedFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                                       const Pose3& T_world_body, const StateEstimate& prior) {
  const StageTimes::Scope timer(times, "lio/features");
  SweepFeatures features = ExtractFeatures(deskewed, sweep, *rig.lidar, config);
  features.deskew = DeskewErrorOf(prior, sweep.span, rig.imu.noise);
  if (lone_axis && config.marks.enabled) {
    features.marks = ExtractMarks(deskewed, T_world_body.rotation().conjugate() * *lone_axis,
                                  *rig.lidar, config.marks);
  }
  return features;
}

RegistrationResult Lio::Impl::TimedRegister(const SweepFeatures& features,
                                            const StateEstimate& prior) {
  const StageTimes::Scope timer(times, "lio/registration");
  return Register(features, map, prior, *rig.lidar, lone_axis, config.registration,
                  config.degeneracy);
}

void Lio::Impl::Accept(const StateEstimate& accepted) {
  estimate = accepted;
  // What drives it further is no clock.
  const double most = kMostOffsetSigmas * config.time_offset_sigma;
  estimate.mean.time_offset = std::clamp(estimate.mean.time_offset, -most, most);
  Forget(OnImuClock(estimate.mean.nav.stamp));
}

// Returns the share of the sweep that was new to the map.
double Lio::Impl::Insert(const SweepFeatures& features, const Pose3& T_world_body) {
  const double new_share = map.Insert(features, T_world_body);
  map_age -= std::log1p(-std::min(new_share, kMostReplaced));
  return new_share;
}

LioResult Lio::Impl::Track(const SweepFeatures& features, const RegistrationResult& registration,
                           double silent) {
  const StageTimes::Scope timer(times, "lio/map");
  const Pose3 before = estimate.mean.nav.T_world_body;
  Accept(registration.estimate);
  lone_axis = registration.lone_axis;
  if (registration.converged) last_registered = estimate.mean.nav.stamp;
  LioResult result = Figures(registration, LioResult::Status::kTracking);
  result.time_offset = TimeOffsetOf(estimate);
  result.reason = features.note;
  const double age = map_age;
  JudgeFit(registration, silent);
  if (silent > 0.0) {
    result.reason = fmt::format(
        "the IMU was silent for {:.2f} s: deskewed by its registration, kept out of the map",
        silent);
  } else if (fits_badly) {
    result.reason = fmt::format("{} of {} points fit after the IMU's silence: kept out of the map",
                                registration.correspondences, registration.offered);
  } else if (!registration.converged) {
    result.reason = "the registration did not converge: kept out of the map";
  } else {
    result.new_share = Insert(features, estimate.mean.nav.T_world_body);
  }
  drift = GrownDrift(drift, before, estimate, result.new_share);
  result.estimates.push_back(Reported(registration, age));
  result.clouds.push_back(std::make_shared<PointCloud>(features.cloud));
  return result;
}

// Covariance of the estimate in the map (pose chart).
Matrix6d Lio::Impl::PoseInMap() const {
  const Matrix15d in_map = estimate.covariance.topLeftCorner<15, 15>();
  return PoseChartCovariance(estimate.mean.nav.T_world_body.R(), in_map);
}

// `age` of the map when the sweep was registered.
OdometryEstimate Lio::Impl::Reported(const RegistrationResult& registration, double age) const {
  OdometryEstimate reported{.state = estimate.mean.nav,
                            .covariance = ReportedCovariance(estimate, drift),
                            .degeneracy = registration.degeneracy,
                            .map = MapTie{.covariance = PoseInMap(), .age = age}};
  // Such a pose is where the search ended, and no measurement of where the body is.
  if (fits_badly) reported.degeneracy.information.setZero();
  return reported;
}

void Lio::Impl::JudgeFit(const RegistrationResult& registration, double silent) {
  constexpr double kGain = 0.1;
  recovering = silent > 0.0 ? config.gap.recovery_sweeps : std::max(recovering - 1, 0);
  fits_badly = recovering > 0 && (FitsWorse(registration, usual_share) || !registration.converged);
  if (fits_badly) return;
  if (silent == 0.0) recovering = 0;
  const double share = Share(registration);
  usual_share = usual_share == 0.0 ? share : (1.0 - kGain) * usual_share + kGain * share;
}

// Registration finds the nearest minimum only: with a prediction known worse than it searches, a
// fit means nothing.
bool Lio::Impl::BeyondSearch(const StateEstimate& prior) const {
  const double variance = PoseCovariance(prior.covariance).diagonal().head<3>().maxCoeff();
  return std::sqrt(variance) > config.registration.max_search_distance;
}

// After a long time without registration, what fits worse than usual is taken for another place,
// and what still does not converge for no place at all.
bool Lio::Impl::Found(const RegistrationResult& registration, Time now) const {
  const bool doubtful = FitsWorse(registration, usual_share) || !registration.converged;
  return registration.correspondences >= config.registration.min_correspondences &&
         IsFinite(registration.estimate) && !(Overdue(now) && doubtful);
}

LioResult Lio::Impl::Lose(const LidarSweep& sweep, const RegistrationResult& registration,
                          const StateEstimate& prior, double silent) {
  const double silence = (prior.mean.nav.stamp - last_registered).seconds();
  const std::string why = fmt::format(
      "{} of {} points found a place in the local map of {} points (usual share {:.2f}, "
      "lio.registration.min_correspondences = {}); predicted by the IMU for {:.1f} s",
      registration.correspondences, registration.offered, map.size(), usual_share,
      config.registration.min_correspondences, silence);
  if (Overdue(sweep.end())) return GiveUp(sweep, prior, silent, why + "; ");
  drift = GrownDrift(drift, estimate.mean.nav.T_world_body, prior, 0.0);
  Accept(prior);
  LioResult result = Figures(registration, LioResult::Status::kRejected);
  result.rejection = "not registered";
  result.reason = why;
  return result;
}

LioResult Lio::Impl::GiveUp(const LidarSweep& sweep, const StateEstimate& prior, double silent,
                            const std::string& why) {
  const double unwatched = (sweep.end() - estimate.mean.nav.stamp).seconds();
  placement = PlaceOf(estimate, prior, silent, unwatched, config);
  const double lost = (sweep.end() - last_registered).seconds();
  start.emplace(config, rig);
  map.Clear();
  map_age = 0.0;
  lone_axis.reset();
  fits_badly = false;
  recovering = 0;
  usual_share = 0.0;
  // The driver may have begun anew, too.
  estimate.covariance(kTimeOffset, kTimeOffset) =
      config.time_offset_sigma * config.time_offset_sigma;
  Forget(OnImuClock(sweep.stamp));
  LioResult result = Begin(sweep);
  result.lost = true;
  const Vector6d sigma = placement->covariance.diagonal().cwiseSqrt();
  result.reason = fmt::format(
      "{}no registration for {:.1f} s (lio.lost_after = {:.1f} s), {:.1f} s of them without IMU: a "
      "new start begins, placed where the body is supposed to be, known to {:.3g} m and {:.3g} rad",
      why, lost, config.lost_after, silent, sigma.head<3>().maxCoeff(), sigma.tail<3>().maxCoeff());
  return result;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/vio.h"

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/imu/levelling.h"
#include "mlvi/imu/propagation.h"
#include "mlvi/state/frame_change.h"
#include "mlvi/vio/frame_history.h"
#include "mlvi/vio/lidar_depth.h"
#include "mlvi/vio/sliding_window.h"
#include "mlvi/vio/window_features.h"

namespace mlvi {
namespace {

Expected<PanoramaModel> PanoramaOf(const Rig& rig, const VioConfig& config) {
  return PanoramaModel::FromRig(rig, {.radius = config.radius});
}

PanoramaModel MakePanorama(const Rig& rig, const VioConfig& config) {
  Expected<PanoramaModel> model = PanoramaOf(rig, config);
  MLVI_CHECK(model.has_value(), "{}", model.error().message);
  return std::move(*model);
}

VioCalibration CalibrationOf(const PanoramaModel& model) {
  VioCalibration calibration{.T_body_pano = model.T_body_pano(), .radius = model.radius()};
  for (int i = 0; i < model.cameras(); ++i) {
    calibration.T_pano_camera.push_back(model.T_pano_camera(i));
    calibration.time_offsets.push_back(0.0);
  }
  return calibration;
}

// Position and heading of a pose, as the frame of a start whose first body has neither.
Pose3 PlaceOf(const Pose3& T_world_body) {
  const Eigen::Matrix3d R = T_world_body.R();
  const Eigen::Vector3d up = R.transpose().col(2);
  return Pose3(ExpSo3({0.0, 0.0, Heading(up).Of(R)}), T_world_body.translation());
}

}  // namespace

struct Vio::Impl {
  Impl(const VioConfig& vio_config, const Rig& rig, StageTimes& stage_times)
      : config(vio_config),
        imu_spec(rig.imu),
        gravity(rig.gravity),
        times(stage_times),
        tracker(MakePanorama(rig, config), config.tracker),
        window(config.window, config.keyframe, rig.imu, rig.gravity,
               CalibrationOf(tracker.model())),
        depth(config.depth),
        failure(config.failure, rig.imu),
        history(Duration::FromSeconds(config.imu_memory)) {}

  VioResult Process(const ImageSet& set, std::span<const ImuSample> imu);
  FrameImages ImagesOf(const ImageSet& set) const;
  void Remember(std::span<const ImuSample> imu, const ImageSet& set);
  std::vector<Pose3> ImagePlaces(const FrameImages& images,
                                 const std::optional<NavState>& state) const;
  std::optional<OdometryEstimate> PropagatedStart(Time stamp);
  void TryStart(const ImageSet& set, VioResult& result);
  std::vector<FrameInstant> StartFrames() const;
  Expected<OdometryEstimate> FirstState() const;
  TrackingSummary Track(const ImageSet& set, const std::optional<NavState>& predicted);
  TrackingHints Hints(FrameId frame) const;
  void Begin(const ImageSet& set, const OdometryEstimate& start, VioResult& result);
  bool AtRest(Time now) const;
  void Estimate(const ImageSet& set, const NavState& predicted, VioResult& result);
  void Fail(std::string reason, VioResult& result);
  void ApplyCalibration();

  VioConfig config;
  ImuSpec imu_spec;
  double gravity;
  StageTimes& times;
  PanoramicTracker tracker;
  SlidingWindow window;
  LidarDepth depth;
  FailureDetector failure;
  FrameHistory history;
  std::optional<OdometryEstimate> pending_start;
  std::string failure_reason;
  std::string start_objection = "waiting for a first state";
  Time next_attempt;               // at a start from what was seen
  Time start_after;                // what was seen before went into an estimate that failed
  std::optional<Pose3> last_pose;  // the last one that was believed
  FrameId frame;                   // of the set in work
  bool new_cloud = false;
  Time last_search;  // for depths in the clouds
};

Expected<void> CheckRig(const VioConfig& config, const Rig& rig) {
  return PanoramaOf(rig, config).map([](const PanoramaModel&) {});
}

Vio::Vio(const VioConfig& config, const Rig& rig, StageTimes& times)
    : impl_(std::make_unique<Impl>(config, rig, times)) {}
Vio::~Vio() = default;

VioResult Vio::Process(const ImageSet& set, std::span<const ImuSample> imu) {
  const StageTimes::Scope scope(impl_->times, "vio");
  return impl_->Process(set, imu);
}

void Vio::AddDepthCloud(const PointCloud& points_body, const Pose3& T_world_body, Time stamp) {
  const StageTimes::Scope scope(impl_->times, "vio_cloud");
  impl_->depth.Add(points_body, T_world_body, stamp);
  impl_->new_cloud = true;
}

void Vio::ClearDepthClouds() { impl_->depth.Clear(); }

void Vio::Start(const OdometryEstimate& state) { impl_->pending_start = state; }

const VioCalibration& Vio::calibration() const { return impl_->window.window().calibration; }

std::span<const Track> Vio::tracks() const { return impl_->tracker.tracks().tracks(); }

VioResult Vio::Impl::Process(const ImageSet& set, std::span<const ImuSample> imu) {
  VioResult result;
  frame = FrameId(frame.value() + 1);
  Remember(imu, set);
  const std::optional<OdometryEstimate> start = PropagatedStart(set.stamp);
  std::optional<NavState> predicted;
  if (start) {
    predicted = start->state;
  } else if (window.started()) {
    predicted = window.Predict(history.samples(), set.stamp);
  }
  result.tracking = Track(set, predicted);
  if (start) {
    Begin(set, *start, result);
  } else if (window.started()) {
    Estimate(set, *predicted, result);
  } else {
    TryStart(set, result);
  }
  return result;
}

FrameImages Vio::Impl::ImagesOf(const ImageSet& set) const {
  FrameImages images{.frame = frame, .stamp = set.stamp};
  images.delays.resize(static_cast<std::size_t>(tracker.model().cameras()));
  for (const Image& image : set.images) {
    images.delays[static_cast<std::size_t>(image.camera)] = image.stamp - set.stamp;
  }
  return images;
}

void Vio::Impl::Remember(std::span<const ImuSample> imu, const ImageSet& set) {
  history.AddSamples(imu);
  tracker.tracks().ForgetBefore(history.AddFrame(frame, set.stamp, ImagesOf(set).delays));
}

// Where the body is at the instant of each image, in the body at the set's stamp: without a state
// only how it is turned. Empty without IMU.
std::vector<Pose3> Vio::Impl::ImagePlaces(const FrameImages& images,
                                          const std::optional<NavState>& state) const {
  std::vector<Pose3> places;
  if (history.samples().empty()) return places;
  const NavState at = state.value_or(NavState());
  for (std::size_t c = 0; c < images.delays.size(); ++c) {
    const ImageTiming timing =
        TimeImage(history.samples(), images.stamp, images.delays[c], at.bias, imu_spec);
    const ImagePlace place(Pose3(), MotionOfImage(timing, at, gravity),
                           window.window().calibration.time_offsets[c]);
    places.push_back(state ? place.T_world_image
                           : Pose3(place.T_world_image.rotation(), Eigen::Vector3d::Zero()));
  }
  return places;
}

// The pending start, carried to `stamp` by the IMU. One from before the samples that are remembered
// is given up.
std::optional<OdometryEstimate> Vio::Impl::PropagatedStart(Time stamp) {
  if (!pending_start || pending_start->state.stamp > stamp || history.samples().empty())
    return std::nullopt;
  if (pending_start->state.stamp == stamp) return pending_start;
  if (pending_start->state.stamp < history.samples().front().stamp) {
    pending_start.reset();
    return std::nullopt;
  }
  const std::vector<ImuSample> between =
      SamplesBetween(history.samples(), pending_start->state.stamp, stamp);
  Propagation propagation =
      Propagate(pending_start->state, pending_start->covariance, between, imu_spec, gravity);
  OdometryEstimate start{.state = propagation.states.back(), .covariance = propagation.covariance};
  return start;
}

// A start from cameras and IMU alone.
void Vio::Impl::TryStart(const ImageSet& set, VioResult& result) {
  if (!next_attempt.valid() || set.stamp >= next_attempt) {
    const StageTimes::Scope scope(times, "vio_start");
    next_attempt = set.stamp + Duration::FromSeconds(config.start.retry_interval);
    const Expected<OdometryEstimate> first = FirstState();
    if (first) return Begin(set, *first, result);
    start_objection = first.error().message;
  }
  const bool failed = !failure_reason.empty();
  result.status = failed ? VioResult::Status::kFailed : VioResult::Status::kInitializing;
  result.reason = failed ? failure_reason + "; new start: " + start_objection : start_objection;
}

// The newest sets that a start is made from, thinned, in the order of time.
std::vector<FrameInstant> Vio::Impl::StartFrames() const {
  std::vector<FrameInstant> frames;
  const std::span<const FrameHistory::Frame> all = history.frames();
  const Time oldest = all.back().stamp - Duration::FromSeconds(config.start.max_seconds);
  for (auto seen = all.rbegin(); seen != all.rend(); ++seen) {
    if (seen->stamp < oldest || seen->stamp < history.samples().front().stamp) break;
    if (start_after.valid() && seen->stamp <= start_after) break;
    if (!frames.empty() &&
        (frames.back().stamp - seen->stamp).seconds() < config.start.frame_interval) {
      continue;
    }
    frames.push_back({seen->id, seen->stamp, seen->delays});
  }
  std::reverse(frames.begin(), frames.end());
  return frames;
}

Expected<OdometryEstimate> Vio::Impl::FirstState() const {
  if (history.samples().empty()) return MakeError(ErrorKind::kEstimation, "no IMU samples yet");
  const std::vector<FrameInstant> frames = StartFrames();
  const Expected<Initialization> start =
      InitializeFromTracks({.tracks = tracker.tracks().tracks(),
                            .frames = frames,
                            .samples = history.samples(),
                            .T_body_pano = tracker.model().T_body_pano(),
                            .pixel_sigma = config.window.pixel_sigma,
                            .time_offsets = window.window().calibration.time_offsets},
                           imu_spec, gravity, config.start);
  if (!start) return tl::unexpected(start.error());
  const OdometryEstimate first{.state = start->states.back(), .covariance = start->covariance};
  // After a failure the trajectory goes on where it ended: how far it went meanwhile is not known.
  return last_pose ? InFrame(PlaceOf(*last_pose), first) : first;
}

TrackingSummary Vio::Impl::Track(const ImageSet& set, const std::optional<NavState>& predicted) {
  const StageTimes::Scope scope(times, "vio_tracking");
  if (predicted) history.SetPose(frame, predicted->T_world_body);
  history.SetImagePlaces(frame, ImagePlaces(ImagesOf(set), predicted));
  return tracker.Process(frame, set.images, Hints(frame));
}

TrackingHints Vio::Impl::Hints(FrameId now) const {
  TrackingHints hints;
  hints.motion = [this, now](FrameId earlier) {
    return history.Motion(earlier, now, tracker.model().T_body_pano(),
                          window.started() ? window.window().frames.back().state.bias.gyroscope
                                           : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  };
  hints.image_place = [this](FrameId seen_in, int camera) {
    return history.ImagePlace(seen_in, camera, tracker.model().T_body_pano());
  };
  if (window.started()) {
    hints.inverse_depth = [this](TrackId track) {
      return TrackInverseDepth(window.window(), track, config.window);
    };
  }
  return hints;
}

void Vio::Impl::Begin(const ImageSet& set, const OdometryEstimate& start, VioResult& result) {
  pending_start.reset();
  failure_reason.clear();
  failure.Reset();
  window.Start(ImagesOf(set), start, history.samples(), tracker.tracks());
  result.status = VioResult::Status::kTracking;
  result.estimate = start;
  result.estimate->state.stamp = set.stamp;
  result.keyframe = true;
}

// Whether the rig has stood still since the newest frame that is long enough ago.
bool Vio::Impl::AtRest(Time now) const {
  const Time latest = now - Duration::FromSeconds(config.rest.seconds);
  const std::span<const FrameHistory::Frame> frames = history.frames();
  const auto before = std::find_if(frames.rbegin(), frames.rend(),
                                   [&](const auto& seen) { return seen.stamp <= latest; });
  if (before == frames.rend()) return false;
  return IsAtRest(tracker.tracks(), before->id, frame,
                  SamplesBetween(history.samples(), before->stamp, now), imu_spec, config.rest);
}

void Vio::Impl::Estimate(const ImageSet& set, const NavState& predicted, VioResult& result) {
  window.Add(ImagesOf(set), history.samples(), tracker.tracks());
  if (AtRest(set.stamp)) window.AddRest(config.rest.velocity_sigma);
  const bool due = !last_search.valid() ||
                   set.stamp - last_search >= Duration::FromSeconds(config.depth.interval);
  if (new_cloud && due) {
    const StageTimes::Scope scope(times, "vio_depth");
    depth.Associate(window.window(), config.window);
    new_cloud = false;
    last_search = set.stamp;
  }
  WindowEstimate estimate;
  {
    const StageTimes::Scope scope(times, "vio_window");
    estimate = window.Solve();
  }
  result.features = estimate.features;
  result.features_with_lidar = estimate.features_with_lidar;
  result.iterations = estimate.iterations;
  result.rms_px = estimate.rms_px;
  result.camera_rms_px = estimate.camera_rms_px;
  result.deviation = estimate.deviation;
  if (std::string reason = failure.Check(estimate, predicted); !reason.empty()) {
    return Fail(std::move(reason), result);
  }
  result.status = VioResult::Status::kTracking;
  result.estimate = estimate.newest;
  result.motion = estimate.motion;
  last_pose = estimate.newest.state.T_world_body;
  history.SetPose(frame, *last_pose);
  const StageTimes::Scope scope(times, "vio_slide");
  for (const TrackId track : window.Slide()) tracker.tracks().End(track);
  result.keyframe = window.newest_is_keyframe();
  ApplyCalibration();
}

void Vio::Impl::Fail(std::string reason, VioResult& result) {
  failure_reason = std::move(reason);
  start_after = next_attempt = history.frames().back().stamp;
  window.Clear();
  history.ForgetPoses();
  result.status = VioResult::Status::kFailed;
  result.reason = failure_reason;
}

// The tracker predicts and lifts with what has been estimated.
void Vio::Impl::ApplyCalibration() {
  if (config.window.extrinsics == ExtrinsicsCalibration::kOff) return;
  const VioCalibration& calibration = window.window().calibration;
  PanoramaModel model = tracker.model();
  model.set_T_body_pano(calibration.T_body_pano);
  for (int i = 0; i < model.cameras(); ++i) {
    model.set_T_pano_camera(i, calibration.T_pano_camera[static_cast<std::size_t>(i)]);
  }
  tracker.set_model(model);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/slam.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mlvi/state/frame_change.h"

namespace mlvi {
namespace {

// More than the longest start (start.max_span) and the longest factor (graph.keyframe_interval)
// need.
constexpr Duration kImuMemory = Duration::FromMilliseconds(120'000);
// By which the LiDAR's time offset may be found to be less than it was, from keyframe to keyframe.
constexpr Duration kMostOffsetChange = Duration::FromMilliseconds(100);

}  // namespace

void SlamConfig::Declare(ConfigDeclaration& d) {
  d.Section("sequencer", sequencer);
  d.Section("lio", lio);
  d.Section("graph", graph);
  d.Field("feedback", feedback, {"never", "after_loops", "always"},
          "When the graph's correction is applied to the causal poses");
  d.Section("supervisor", supervisor);
  visual.Declare(d);
}

Expected<void> CheckRig(const SlamConfig& config, const Rig& rig) {
  if (!rig.lidar && rig.cameras.empty()) {
    return MakeError(ErrorKind::kConfiguration, "rig '{}' has neither LiDAR nor camera", rig.name);
  }
  return rig.cameras.empty() ? Expected<void>() : CheckRig(config.visual.vio, rig);
}

Slam::Slam(const SlamConfig& config, const Rig& rig)
    : config_(config),
      rig_(rig),
      times_(std::make_unique<StageTimes>()),
      sequencer_(config.sequencer, events_, rig.CameraNames()),
      supervisor_(config.supervisor, rig, events_),
      graph_(config.graph, rig),
      imu_(kImuMemory) {
  const Expected<void> agree = ConfigDeclaration::Of(config_).Check();
  MLVI_CHECK(agree.has_value(), "{}", agree ? "" : agree.error().message);
  const Expected<void> fits = CheckRig(config, rig);
  MLVI_CHECK(fits.has_value(), "{}", fits ? "" : fits.error().message);
  if (rig.lidar) lio_.emplace(config.lio, rig, *times_);
  if (!rig.cameras.empty()) visual_.emplace(config.visual, rig, *times_, events_);
}

void Slam::Process(const Measurement& measurement) {
  for (const Measurement& ordered : sequencer_.Push(measurement)) ProcessOrdered(ordered);
}

void Slam::Finish(const DropCounts& dropped) {
  for (const Measurement& ordered : sequencer_.Flush()) ProcessOrdered(ordered);
  for (; !sweeps_.empty(); sweeps_.pop_front()) ProcessSweep(sweeps_.front());
  if (visual_) {
    for (const ImageSet& set : visual_->Flush()) ProcessImages(set);
    visual_->AddDropped(sequencer_.dropped());
    visual_->AddDropped(dropped);
    visual_->Conclude();
  }
  SettleGraph();
  TellTimeOffset();
  supervisor_.AddDropped(sequencer_.dropped());
  supervisor_.AddDropped(dropped);
  supervisor_.Conclude();
}

void Slam::ProcessOrdered(const Measurement& measurement) {
  if (const auto* sample = std::get_if<ImuSample>(&measurement)) {
    ProcessImu(*sample);
  } else if (const auto* sweep = std::get_if<LidarSweep>(&measurement)) {
    if (!lio_) return;
    sweeps_.push_back(*sweep);
    ReleaseSweeps();
  } else if (visual_) {
    for (const ImageSet& set : visual_->Collect(std::get<Image>(measurement))) ProcessImages(set);
  }
}

void Slam::ProcessImu(const ImuSample& sample) {
  supervisor_.Observe(sample);
  imu_.Add(sample);
  newest_imu_ = sample.stamp;
  ReleaseSweeps();
  if (!imu_needed_from_.valid())
    imu_needed_from_ = last_sweep_end_ = images_needed_from_ = sample.stamp;
  if (visual_) {
    for (const ImageSet& set : visual_->Advance(sample.stamp)) ProcessImages(set);
  }
  if (!current_ || sample.stamp <= current_->stamp) return;
  const std::vector<ImuSample> step = imu_.Between(current_->stamp, sample.stamp);
  current_ = Predict(*current_, Preintegrate(step, current_->bias, rig_.imu), rig_.gravity);
}

// A LiDAR whose clock is behind the IMU's ends its sweeps later than they say.
void Slam::ReleaseSweeps() {
  while (!sweeps_.empty() && sweeps_.front().end() + odometry_offset_ <= newest_imu_) {
    ProcessSweep(sweeps_.front());
    sweeps_.pop_front();
  }
}

void Slam::ProcessSweep(const LidarSweep& sweep) {
  const StageTimes::Scope scope(*times_, "sweep");
  const Time end = std::max(sweep.end(), sweep.end() + odometry_offset_);
  const std::vector<ImuSample> imu = imu_.Between(imu_needed_from_, end);
  const LioResult result = lio_->Process(sweep, imu);
  imu_needed_from_ = std::max(imu_needed_from_, end);
  supervisor_.Observe(sweep, result, ImuBetweenEstimates(last_sweep_end_, sweep.end()));
  last_sweep_end_ = std::max(last_sweep_end_, sweep.end());
  if (result.lost) {
    current_.reset();
    if (visual_) visual_->LoseLidar();
  }
  if (result.gap) gap_ = result.gap;
  if (result.estimates.empty()) return;
  lidar_time_offset_ = result.time_offset;
  odometry_offset_ = Duration::FromSeconds(lidar_time_offset_.seconds);
  TakeEstimates(
      {.estimates = result.estimates, .clouds = result.clouds, .relative = result.relative});
  if (!visual_) return;
  OdometryEstimate newest = result.estimates.back();
  newest.state.stamp = newest.state.stamp + odometry_offset_;
  visual_->TakeLidar(newest, *result.clouds.back());
}

// What the IMU measured while the clock of the estimates went from `from` to `to`, by that clock.
std::vector<ImuSample> Slam::ImuBetweenEstimates(Time from, Time to) const {
  std::vector<ImuSample> samples = imu_.Between(from + odometry_offset_, to + odometry_offset_);
  for (ImuSample& sample : samples) sample.stamp = sample.stamp - odometry_offset_;
  return samples;
}

// With a LiDAR the visual estimate stands beside the LiDAR's, which starts it and gives it depth;
// alone it is the odometry.
void Slam::ProcessImages(const ImageSet& set) {
  const StageTimes::Scope scope(*times_, "image_set");
  const VioResult result = visual_->Process(set, imu_.Between(images_needed_from_, set.stamp));
  images_needed_from_ = set.stamp;
  if (lio_ || !result.estimate) return;
  if (result.motion) visual_motion_.Extend(*result.motion);
  const std::shared_ptr<const PointCloud> no_cloud;
  TakeEstimates({.estimates = {&*result.estimate, 1}, .clouds = {&no_cloud, 1}, .relative = {}});
}

void Slam::TakeEstimates(const EstimateBatch& batch) {
  const std::span<const OdometryEstimate> estimates = batch.estimates;
  for (const OdometryEstimate& estimate : estimates)
    odometry_.push_back({estimate.state.stamp, T_world_odometry_ * estimate.state.T_world_body});
  const std::size_t before = graph_.keyframes().size();
  if (gap_ || graph_.WantsKeyframe(estimates.back().state)) AddKeyframes(batch);
  newest_ = InFrame(T_world_odometry_, estimates.back());
  PropagateFromNewest();
  for (const OdometryEstimate& estimate : estimates) Anchor(estimate, before);
}

// To the newest keyframe that is not later; before the first keyframe of a start to that one.
void Slam::Anchor(const OdometryEstimate& estimate, std::size_t first_keyframe) {
  const std::vector<Keyframe>& keyframes = graph_.keyframes();
  if (keyframes.empty()) return;
  std::size_t k = keyframes.size() - 1;
  while (k > first_keyframe && keyframes[k].state.stamp > estimate.state.stamp) --k;
  anchored_.push_back(
      {.stamp = estimate.state.stamp,
       .keyframe = keyframes[k].id,
       .T_keyframe_body = keyframes[k].state.T_world_body.inverse() * estimate.state.T_world_body});
}

void Slam::PropagateFromNewest() {
  const Time now = newest_->state.stamp + odometry_offset_;
  const Time reached = current_ ? std::max(current_->stamp, now) : now;
  current_ = newest_->state;
  current_->stamp = now;
  if (const auto ahead = imu_.Between(current_->stamp, reached); ahead.size() > 1) {
    current_ = Predict(*current_, Preintegrate(ahead, current_->bias, rig_.imu), rig_.gravity);
  }
}

void Slam::AddKeyframes(const EstimateBatch& batch) {
  const StageTimes::Scope scope(*times_, "graph");
  const NavState& newest = batch.estimates.back().state;
  const Expected<GraphUpdate> update = AddToGraph(batch);
  if (!update) {
    events_.Raise({.stamp = newest.stamp,
                   .severity = Severity::kWarning,
                   .source = "graph",
                   .message = "keyframe left out: " + update.error().message});
    return;
  }
  gap_.reset();
  visual_motion_.Restart(newest.stamp);
  const Time needed = newest.stamp + odometry_offset_ - kMostOffsetChange;
  imu_.TrimBefore(visual_ ? std::min(needed, images_needed_from_) : needed);
  if (TakesFeedback()) {
    T_world_odometry_ = update->newest.T_world_body * newest.T_world_body.inverse();
  }
}

Expected<GraphUpdate> Slam::AddToGraph(const EstimateBatch& batch) {
  if (graph_.keyframes().empty()) return graph_.Begin(batch);
  if (gap_) return graph_.BeginAfterGap(batch, *gap_);
  const OdometryEstimate& last = batch.estimates.back();
  const Time from = graph_.keyframes().back().state.stamp, to = last.state.stamp;
  return graph_.Add(last, batch.clouds.back(), ImuBetweenEstimates(from, to),
                    visual_motion_.To(to));
}

// After the last keyframe no addition follows that would take up what is left to be linearised.
void Slam::SettleGraph() {
  if (graph_.keyframes().empty()) return;
  const StageTimes::Scope scope(*times_, "graph");
  const Expected<GraphUpdate> update = graph_.Settle();
  if (update) return;
  events_.Raise({.stamp = graph_.keyframes().back().state.stamp,
                 .severity = Severity::kWarning,
                 .source = "graph",
                 .message = "not settled: " + update.error().message});
}

// What mounts and noise that differ from the rig's make of a dull motion passes for an offset, too: it
// has to be known far better than it was.
bool Slam::KnowsTimeOffset() const {
  constexpr double kGain = 6.0;
  return lidar_time_offset_.sigma > 0.0 &&
         lidar_time_offset_.sigma * kGain < config_.lio.time_offset_sigma;
}

void Slam::TellTimeOffset() {
  constexpr double kUnusual = 0.005;  // s
  const double offset = lidar_time_offset_.seconds;
  if (!KnowsTimeOffset() || std::abs(offset) < kUnusual) return;
  events_.Raise({.stamp = newest_->state.stamp,
                 .severity = Severity::kWarning,
                 .source = "lidar",
                 .message = fmt::format(
                     "its stamps are {:.1f} +- {:.1f} ms {} by the IMU's clock; estimated on the "
                     "way, and in calibrated_rig.yaml for a second pass, whose start knows it",
                     1e3 * std::abs(offset), 1e3 * lidar_time_offset_.sigma,
                     offset > 0.0 ? "early" : "late")});
}

bool Slam::TakesFeedback() const {
  return config_.feedback == GraphFeedback::kAlways ||
         (config_.feedback == GraphFeedback::kAfterLoops && graph_.loops() > 0);
}

std::map<std::string, StreamReport> Slam::Streams() const {
  std::map<std::string, StreamReport> streams = supervisor_.streams();
  if (visual_) streams.merge(visual_->Streams());
  return streams;
}

Trajectory Slam::SmoothedTrajectory() const {
  Trajectory trajectory;
  trajectory.reserve(anchored_.size());
  for (const Anchored& pose : anchored_) {
    trajectory.push_back(
        {pose.stamp, graph_.Estimate(pose.keyframe).T_world_body * pose.T_keyframe_body});
  }
  return trajectory;
}

}  // namespace mlvi

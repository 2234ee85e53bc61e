// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/frame_history.h"

#include <algorithm>

#include "mlvi/base/error.h"
#include "mlvi/imu/preintegration.h"

namespace mlvi {

void FrameHistory::AddSamples(std::span<const ImuSample> samples) {
  for (const ImuSample& sample : samples) {
    if (samples_.empty() || sample.stamp > samples_.back().stamp) samples_.push_back(sample);
  }
}

FrameId FrameHistory::AddFrame(FrameId id, Time stamp, std::vector<Duration> delays) {
  MLVI_CHECK(frames_.empty() || (id > frames_.back().id && stamp > frames_.back().stamp),
             "frame {} at {} after frame {} at {}", id.value(), ToString(stamp),
             frames_.back().id.value(), ToString(frames_.back().stamp));
  // The frame before stays whatever its age: a window that goes on across a pause starts from it.
  const Time oldest =
      frames_.empty() ? stamp - memory_ : std::min(stamp - memory_, frames_.back().stamp);
  frames_.push_back({.id = id, .stamp = stamp, .delays = std::move(delays)});
  std::erase_if(frames_, [&](const Frame& frame) { return frame.stamp < oldest; });
  // One sample before the oldest frame stays, so that its instant is covered.
  auto first = std::lower_bound(samples_.begin(), samples_.end(), oldest,
                                [](const ImuSample& s, Time time) { return s.stamp < time; });
  if (first != samples_.begin()) samples_.erase(samples_.begin(), first - 1);
  return frames_.front().id;
}

void FrameHistory::SetImagePlaces(FrameId id, std::vector<Pose3> T_body_image) {
  for (Frame& frame : frames_) {
    if (frame.id == id) frame.T_body_image = std::move(T_body_image);
  }
}

Pose3 FrameHistory::ImagePlace(FrameId id, int camera, const Pose3& T_body_pano) const {
  const Frame* frame = Find(id);
  if (frame == nullptr || frame->T_body_image.empty()) return {};
  return T_body_pano.inverse() * frame->T_body_image[static_cast<std::size_t>(camera)] *
         T_body_pano;
}

void FrameHistory::SetPose(FrameId id, const Pose3& T_world_body) {
  for (Frame& frame : frames_) {
    if (frame.id == id) frame.T_world_body = T_world_body;
  }
}

void FrameHistory::ForgetPoses() {
  for (Frame& frame : frames_) frame.T_world_body.reset();
}

const FrameHistory::Frame* FrameHistory::Find(FrameId id) const {
  for (const Frame& frame : frames_) {
    if (frame.id == id) return &frame;
  }
  return nullptr;
}

PredictedMotion FrameHistory::Motion(FrameId earlier, FrameId now, const Pose3& T_body_pano,
                                     const Eigen::Vector3d& gyroscope_bias) const {
  const Frame *from = Find(earlier), *to = Find(now);
  if (from == nullptr || to == nullptr) return {};
  if (from->T_world_body && to->T_world_body) {
    const Pose3 T =
        T_body_pano.inverse() * from->T_world_body->inverse() * *to->T_world_body * T_body_pano;
    return {T.rotation(), T.translation()};
  }
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  const std::vector<ImuSample> between = SamplesBetween(samples_, from->stamp, to->stamp);
  for (std::size_t k = 1; k < between.size(); ++k) {
    const double dt = (between[k].stamp - between[k - 1].stamp).seconds();
    const Eigen::Vector3d rate =
        0.5 * (between[k - 1].angular_velocity + between[k].angular_velocity) - gyroscope_bias;
    R = (R * ExpSo3(dt * rate)).normalized();
  }
  const Eigen::Quaterniond& R_body_pano = T_body_pano.rotation();
  return {R_body_pano.conjugate() * R * R_body_pano, std::nullopt};
}

}  // namespace mlvi

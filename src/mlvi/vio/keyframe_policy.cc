// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/keyframe_policy.h"

#include <cmath>

namespace mlvi {
namespace {

const WindowObservation* ObservationIn(const WindowFeature& feature, FrameId frame) {
  for (const WindowObservation& o : feature.observations) {
    if (o.frame == frame) return &o;
  }
  return nullptr;
}

// By camera: whether anything was seen by it in `frame`.
std::vector<bool> LookingCameras(const VioWindow& window, FrameId frame) {
  std::vector<bool> looking(window.calibration.T_pano_camera.size(), false);
  for (const WindowFeature& feature : window.features) {
    const WindowObservation* o = ObservationIn(feature, frame);
    if (o != nullptr) looking[static_cast<std::size_t>(o->observation.camera)] = true;
  }
  return looking;
}

const WindowFrame& NewestKeyframe(const VioWindow& window) {
  for (std::size_t i = window.frames.size() - 1; i-- > 0;) {
    if (window.frames[i].keyframe) return window.frames[i];
  }
  return window.frames.front();
}

}  // namespace

void KeyframeConfig::Declare(ConfigDeclaration& d) {
  d.Field("min_parallax", min_parallax, "rad",
          "Mean angle between bearings, without rotation, from which a frame becomes a keyframe",
          {0.0, 1.0});
  d.Field("min_common", min_common, "",
          "A frame becomes a keyframe when a smaller share of the last one's features is left",
          {0.0, 1.0});
  d.Field("max_interval", max_interval, "s", "Longest time between keyframes", {0.05, 60.0});
}

FrameNovelty CompareWithKeyframe(const VioWindow& window) {
  const WindowFrame& newest = window.frames.back();
  const WindowFrame& keyframe = NewestKeyframe(window);
  const Eigen::Quaterniond& R_body_pano = window.calibration.T_body_pano.rotation();
  const Eigen::Quaterniond R_keyframe_newest =
      (keyframe.state.T_world_body.rotation() * R_body_pano).conjugate() *
      (newest.state.T_world_body.rotation() * R_body_pano);
  const std::vector<bool> looking = LookingCameras(window, newest.id);
  double sum = 0.0;
  int seen = 0, common = 0;
  for (const WindowFeature& feature : window.features) {
    const WindowObservation* before = ObservationIn(feature, keyframe.id);
    if (before == nullptr) continue;
    const WindowObservation* now = ObservationIn(feature, newest.id);
    // One without an image in the newest set has lost nothing.
    if (looking[static_cast<std::size_t>(before->observation.camera)]) ++seen;
    if (now == nullptr) continue;
    ++common;
    const Eigen::Vector3d turned = R_keyframe_newest * now->observation.bearing;
    sum += 2.0 * std::asin(std::min(1.0, 0.5 * (turned - before->observation.bearing).norm()));
  }
  return {.parallax = common > 0 ? sum / common : 0.0,
          .common = seen > 0 ? static_cast<double>(common) / seen : 0.0,
          .interval = (newest.state.stamp - keyframe.state.stamp).seconds()};
}

bool IsKeyframe(const VioWindow& window, const KeyframeConfig& config) {
  if (window.frames.size() <= 2) return true;
  const FrameNovelty novelty = CompareWithKeyframe(window);
  return novelty.parallax >= config.min_parallax || novelty.common < config.min_common ||
         novelty.interval >= config.max_interval;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/lidar_depth.h"

#include "mlvi/imu/propagation.h"
#include "mlvi/vio/depth_association.h"
#include "mlvi/vio/window_features.h"

namespace mlvi {

void LidarDepth::Add(std::span<const Eigen::Vector3f> points_body, const Pose3& T_lidar_body,
                     Time stamp) {
  const Eigen::Matrix3f R = T_lidar_body.R().cast<float>();
  const Eigen::Vector3f t = T_lidar_body.translation().cast<float>();
  PointCloud points;
  points.reserve(points_body.size());
  for (const Eigen::Vector3f& p : points_body) points.push_back(R * p + t);
  accumulator_.Add(stamp, points);
  sweeps_.push_back({stamp, T_lidar_body});
  while ((stamp - sweeps_.front().stamp).seconds() > config_.span) sweeps_.pop_front();
}

void LidarDepth::Clear() {
  accumulator_.Clear();
  sweeps_.clear();
}

std::optional<Pose3> LidarDepth::FindPlacement(const VioWindow& window) const {
  std::vector<NavState> states;
  for (const WindowFrame& frame : window.frames) states.push_back(frame.state);
  for (auto sweep = sweeps_.rbegin(); sweep != sweeps_.rend(); ++sweep) {
    if (sweep->stamp > states.back().stamp) continue;
    if (sweep->stamp < states.front().stamp) return std::nullopt;
    return InterpolatePose(states, sweep->stamp) * sweep->T_lidar_body.inverse();
  }
  return std::nullopt;
}

int LidarDepth::Associate(VioWindow& window, const WindowConfig& config) {
  if (empty()) return 0;
  const auto T_window_lidar = FindPlacement(window);
  if (!T_window_lidar) return 0;
  const WindowFrame& frame = window.frames.back();
  const Pose3 T_world_pano = frame.state.T_world_body * window.calibration.T_body_pano;
  const Pose3 T_lidar_pano = T_window_lidar->inverse() * T_world_pano;
  const Pose3 T_pano_world = T_world_pano.inverse();
  const SphericalDepthMap map(accumulator_.points(), T_lidar_pano, config_);
  int found = 0;
  for (WindowFeature& feature : window.features) {
    if (feature.lidar || feature.observations.back().frame != frame.id) continue;
    const PanoramicObservation& o = feature.observations.back().observation;
    // In the pano frame at the set's stamp, from where the camera was at its image's.
    const Pose3 T_pano_camera =
        T_pano_world * BodyAtImage(window, frame.id, o.camera) * window.calibration.T_body_pano *
        window.calibration.T_pano_camera[static_cast<std::size_t>(o.camera)];
    const Ray ray{T_pano_camera.translation(), T_pano_camera.rotation() * o.bearing_camera,
                  config.pixel_sigma / o.resolution()};
    const FeatureDepth depth = AssociateDepth(map, ray, config_);
    if (depth.status != DepthStatus::kFound) continue;
    SetLidarDepth(feature, depth.depth, std::sqrt(depth.variance), window, config);
    ++found;
  }
  return found;
}

}  // namespace mlvi

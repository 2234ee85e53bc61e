// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/window_features.h"

#include <algorithm>

#include "mlvi/panorama/bearing_residual.h"
#include "mlvi/vio/window_linearization.h"

namespace mlvi {
namespace {

// The feature of a track; created at its place if there is none.
WindowFeature& FeatureOf(std::vector<WindowFeature>& features, TrackId track) {
  const auto place =
      std::lower_bound(features.begin(), features.end(), track,
                       [](const WindowFeature& f, TrackId wanted) { return f.track < wanted; });
  if (place != features.end() && place->track == track) return *place;
  return *features.insert(place, {.track = track});
}

// The ray that carries a feature anchored at `o`, world frame.
Ray AnchorRay(const VioWindow& window, const WindowObservation& o, const WindowConfig& config) {
  const auto camera = static_cast<std::size_t>(o.observation.camera);
  const PanoramicRay ray =
      MakePanoramicRay(o.observation, window.calibration.T_pano_camera[camera],
                       window.calibration.radius, config.compensation, RayRole::kAnchor);
  const Pose3 T_world_pano =
      BodyAtImage(window, o.frame, o.observation.camera) * window.calibration.T_body_pano;
  return {T_world_pano * ray.origin, T_world_pano.rotation() * ray.direction,
          config.pixel_sigma / o.observation.resolution()};
}

// The largest angle between the first ray and another one.
double Parallax(std::span<const Ray> rays) {
  double largest = 0.0;
  for (const Ray& ray : rays.subspan(1)) {
    largest = std::max(largest, rays[0].direction.cross(ray.direction).norm());
  }
  return largest;
}

bool TriangulateFeature(const VioWindow& window, const WindowConfig& config,
                        WindowFeature& feature) {
  std::vector<Ray> rays;
  for (const WindowObservation& o : feature.observations) {
    rays.push_back(AnchorRay(window, o, config));
  }
  if (Parallax(rays) < config.min_parallax) return false;
  const auto point = Triangulate(rays);
  if (!point) return false;
  const double depth = (point->point - rays[0].origin).dot(rays[0].direction);
  if (!(depth > config.min_depth)) return false;
  feature.inverse_depth = 1.0 / depth;
  return true;
}

// The point at inverse depth rho of one ray, times rho, seen from the origin of another: points at
// infinity stay there.
double MovedInverseDepth(double rho, const Ray& from, const Ray& to) {
  return rho / (from.direction + rho * (from.origin - to.origin)).norm();
}

}  // namespace

Pose3 BodyAtImage(const VioWindow& window, FrameId frame, int camera) {
  const WindowFrame& f = window.frames[static_cast<std::size_t>(window.FindFrame(frame))];
  const auto c = static_cast<std::size_t>(camera);
  return ImagePlace(f.state.T_world_body, f.images[c], window.calibration.time_offsets[c])
      .T_world_image;
}

void AddObservations(VioWindow& window, FrameId frame, const TrackStore& tracks) {
  for (WindowFeature& feature : window.features) feature.alive = false;
  for (const Track& track : tracks.tracks()) {
    if (!track.trusted() || (!track.alive && track.last_frame() != frame)) continue;
    const bool newly_trusted = track.trusted_since == frame;
    WindowFeature& feature = FeatureOf(window.features, track.id);
    feature.alive = track.alive;
    for (const TrackObservation& o : track.observations) {
      if (o.frame != frame && !newly_trusted) continue;
      const int index = feature.seen++;  // counts those in frames that have left the window, too
      if (window.FindFrame(o.frame) >= 0) {
        feature.observations.push_back({o.frame, o.observation, index});
      }
    }
  }
  std::erase_if(window.features, [](const WindowFeature& f) { return f.observations.empty(); });
}

void InitializeDepths(VioWindow& window, const WindowConfig& config) {
  for (WindowFeature& feature : window.features) {
    if (feature.triangulated) continue;
    // Also where the solver has left it at infinity without parallax to show it: to begin anew at
    // a finite depth is measured to be better (docs/decisions.md).
    if (feature.inverse_depth == 0.0) feature.inverse_depth = 1.0 / config.initial_depth;
    if (feature.usable()) feature.triangulated = TriangulateFeature(window, config, feature);
  }
}

double InverseDepthAt(const WindowFeature& feature, std::size_t index, const VioWindow& window,
                      const WindowConfig& config) {
  if (index == 0) return feature.inverse_depth;
  return MovedInverseDepth(feature.inverse_depth,
                           AnchorRay(window, feature.observations.front(), config),
                           AnchorRay(window, feature.observations[index], config));
}

double TrackInverseDepth(const VioWindow& window, TrackId track, const WindowConfig& config) {
  const auto found =
      std::lower_bound(window.features.begin(), window.features.end(), track,
                       [](const WindowFeature& f, TrackId wanted) { return f.track < wanted; });
  if (found == window.features.end() || found->track != track || !found->triangulated) return 0.0;
  return std::max(0.0, InverseDepthAt(*found, found->observations.size() - 1, window, config));
}

void SetLidarDepth(WindowFeature& feature, double depth, double sigma, const VioWindow& window,
                   const WindowConfig& config) {
  const WindowObservation& last = feature.observations.back();
  WindowConfig exact = config;  // LiDAR depths count from the camera, whatever rays features are on
  exact.compensation = Compensation::kRay;
  const Ray from = AnchorRay(window, last, exact);
  const Ray to = AnchorRay(window, feature.observations.front(), config);
  const double rho = MovedInverseDepth(1.0 / depth, from, to);
  feature.lidar = {rho, rho * rho * sigma};
  feature.inverse_depth = rho;  // bearings may pull it away again, if it was an occlusion edge
  feature.triangulated = true;
}

void AnchorAt(WindowFeature& feature, std::size_t index, const VioWindow& window,
              const WindowConfig& config) {
  if (index == 0) return;
  const Ray from = AnchorRay(window, feature.observations.front(), config);
  const Ray to = AnchorRay(window, feature.observations[index], config);
  feature.inverse_depth =
      std::min(MovedInverseDepth(feature.inverse_depth, from, to), 1.0 / config.min_depth);
  if (feature.lidar) {  // the same error of depth: d rho = -rho^2 d depth
    const double rho = MovedInverseDepth(feature.lidar->inverse_depth, from, to);
    const double ratio = rho / feature.lidar->inverse_depth;
    feature.lidar = {rho, feature.lidar->sigma * ratio * ratio};
  }
  feature.observations.erase(feature.observations.begin(),
                             feature.observations.begin() + static_cast<std::ptrdiff_t>(index));
}

void ForgetObservations(VioWindow& window, FrameId frame, const WindowConfig& config) {
  for (WindowFeature& feature : window.features) {
    auto& all = feature.observations;
    std::size_t first = 0;
    while (first < all.size() && all[first].frame == frame) ++first;
    if (first < all.size()) AnchorAt(feature, first, window, config);
    std::erase_if(all, [&](const WindowObservation& o) { return o.frame == frame; });
  }
  std::erase_if(window.features, [](const WindowFeature& f) { return f.observations.empty(); });
}

std::vector<TrackId> RemoveOutliers(VioWindow& window, const WindowConfig& config) {
  const std::vector<double> errors = FeatureErrors(window, config);
  const double limit = config.outlier_sigmas * config.outlier_sigmas;
  std::vector<TrackId> followed;
  std::vector<WindowFeature> kept;
  for (std::size_t f = 0; f < errors.size(); ++f) {
    WindowFeature& feature = window.features[f];
    if (errors[f] <= limit) {
      kept.push_back(std::move(feature));
    } else if (feature.alive) {
      followed.push_back(feature.track);
    }
  }
  window.features = std::move(kept);
  return followed;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/panoramic_tracker.h"

#include <algorithm>
#include <map>

#include "mlvi/base/parallel.h"
#include "mlvi/panorama/outlier_limit.h"
#include "mlvi/panorama/track_consistency.h"

namespace mlvi {
namespace {

// Where a point seen before lies now: its ray at the depth known, or at infinity, from the
// predicted place.
Eigen::Vector3d PredictedPoint(const PanoramicObservation& before, double inverse_depth,
                               const PredictedMotion& motion) {
  const Eigen::Vector3d t = motion.t_earlier_current.value_or(Eigen::Vector3d::Zero());
  return motion.R_earlier_current.conjugate() *
         (before.bearing + inverse_depth * (before.center - t));
}

Pose3 ImagePlace(const TrackingHints& hints, FrameId frame, int camera) {
  return hints.image_place ? hints.image_place(frame, camera) : Pose3();
}

// From one image of a camera to another, rather than from set to set.
PredictedMotion MotionOfCamera(const TrackingHints& hints, FrameId earlier, FrameId now,
                               int camera) {
  PredictedMotion motion = hints.motion(earlier);
  const Pose3 before = ImagePlace(hints, earlier, camera), after = ImagePlace(hints, now, camera);
  const Pose3 between(motion.R_earlier_current,
                      motion.t_earlier_current.value_or(Eigen::Vector3d::Zero()));
  const Pose3 T = before.inverse() * between * after;
  motion.R_earlier_current = T.rotation();
  if (motion.t_earlier_current) motion.t_earlier_current = T.translation();
  return motion;
}

// The pixel in which camera `o.camera` sees it now, and how much nearer it is; empty, when it will
// be out of sight.
struct PredictedView {
  std::optional<Eigen::Vector2d> pixel;
  double nearer = 1.0;
};

PredictedView PredictView(const PanoramaModel& model, const PanoramicObservation& o,
                          double inverse_depth, const PredictedMotion& motion) {
  const Eigen::Vector3d offset = model.T_pano_camera(o.camera).translation();
  const Eigen::Vector3d ray = PredictedPoint(o, inverse_depth, motion) - inverse_depth * offset;
  return {model.ProjectDirection(o.camera, ray), 1.0 / ray.norm()};
}

}  // namespace

void PanoramicTrackerConfig::Declare(ConfigDeclaration& d) {
  d.Field("budget", budget, "", "Features on the whole sphere, whatever the number of cameras",
          {10.0, 10000.0});
  d.Field("trial", trial, "",
          "Estimators count a track when it has been followed through so many sets of images",
          {0.0, 100.0});
  d.Field("trial_limit_px", trial_limit_px, "px",
          "Its places must be those of one fixed point to within this", {0.01, 1000.0});
  d.Field("least_trusted", least_trusted, "",
          "Trials are as much shorter as needed for so many tracks that count", {0.0, 10000.0});
  d.Field("outlier_sigma_px", outlier_sigma_px, "px",
          "Of tracked positions in the worst images, one sigma per axis: the unit of `outliers`. "
          "What estimators weigh them by is `vio.window.pixel_sigma`",
          {0.01, 10.0});
  d.Field("max_gap", max_gap, "s", "Tracks of a camera without images end after this", {0.0, 10.0});
  d.Field("prediction_limit_px", prediction_limit_px, "px",
          "A track whose depth is known ends where it is found farther than this from where depth "
          "and motion have it",
          {0.01, 1000.0});
  d.Field("prediction_scatter", prediction_scatter, "",
          "That limit is at least so many times the scatter (one sigma) of all such distances",
          {1.0, 100.0});
  d.Section("pyramid", pyramid);
  d.Section("flow", flow);
  d.Section("refinement", refinement);
  d.Section("corner", corner);
  d.Section("outliers", outliers);
}

Expected<void> PanoramicTrackerConfig::Validate() const {
  for (const auto& [key, size] :
       {std::pair("pyramid.window_px", pyramid.window_px),
        std::pair("corner.window_px", corner.window_px),
        std::pair("refinement.patch.size_px", refinement.patch.size_px)}) {
    if (size % 2 == 1) continue;
    return MakeError(ErrorKind::kConfiguration,
                     "vio.tracker.{} = {}: must be odd, a window has a middle pixel: use {} or {}",
                     key, size, size - 1, size + 1);
  }
  return {};
}

PanoramicTracker::PanoramicTracker(const PanoramaModel& model, const PanoramicTrackerConfig& config)
    : model_(model),
      config_(config),
      budget_(model, config.budget),
      refiner_(config.refinement),
      turns_(static_cast<std::size_t>(model.cameras()), CellTurns(budget_.cells().size())),
      streams_(static_cast<std::size_t>(model.cameras())) {}

TrackingSummary PanoramicTracker::Process(FrameId frame, std::span<const Image> images,
                                          const TrackingHints& hints) {
  TrackingSummary summary;
  summary.cameras.resize(streams_.size());
  refined_.clear();
  BuildPyramids(images);
  EndStaleTracks();
  Follow(frame, hints, summary);
  RejectOutliers(frame, hints, summary);
  StartTracks(frame, summary);
  TrustTracks(frame, hints, summary);
  summary.refined = static_cast<int>(refined_.size());
  refiner_.Keep(tracks_);
  Advance();
  for (const Track& track : tracks_.tracks()) {
    if (track.alive) ++summary.cameras[static_cast<std::size_t>(track.last().camera)].alive;
  }
  return summary;
}

void PanoramicTracker::BuildPyramids(std::span<const Image> images) {
  for (const Image& image : images) {
    MLVI_CHECK(image.camera >= 0 && image.camera < model_.cameras(), "image of camera {} of {}",
               image.camera, model_.cameras());
    MLVI_CHECK(image.width == model_.camera(image.camera).width() &&
                   image.height == model_.camera(image.camera).height(),
               "camera {}: image of {} x {} px, lens model of {} x {}", image.camera, image.width,
               image.height, model_.camera(image.camera).width(),
               model_.camera(image.camera).height());
  }
  ParallelFor(images.size(), 1, [&](std::size_t i) {
    Stream& stream = streams_[static_cast<std::size_t>(images[i].camera)];
    stream.current = BuildPyramid(images[i], config_.pyramid);
    stream.current_stamp = images[i].stamp;
  });
}

void PanoramicTracker::EndStaleTracks() {
  Time now;
  for (const Stream& stream : streams_) {
    if (!stream.current.empty()) now = std::max(now, stream.current_stamp);
  }
  const Duration max_gap = Duration::FromSeconds(config_.max_gap);
  std::vector<TrackId> stale;
  for (const Track& track : tracks_.tracks()) {
    const Stream& stream = streams_[static_cast<std::size_t>(track.last().camera)];
    if (track.alive && now - stream.previous_stamp > max_gap) stale.push_back(track.id);
  }
  for (const TrackId id : stale) tracks_.End(id);
}

std::vector<PanoramicTracker::CameraTracks> PanoramicTracker::Predict(
    FrameId frame, const TrackingHints& hints) const {
  std::vector<CameraTracks> cameras(streams_.size());
  std::map<std::pair<FrameId, int>, PredictedMotion> motions;  // of each camera since a frame
  for (const Track& track : tracks_.tracks()) {
    const PanoramicObservation& last = track.last();
    const auto camera = static_cast<std::size_t>(last.camera);
    if (!track.alive || streams_[camera].current.empty()) continue;
    const std::pair key(track.last_frame(), last.camera);
    auto motion = motions.find(key);
    if (motion == motions.end()) {
      motion = motions.emplace(key, MotionOfCamera(hints, key.first, frame, key.second)).first;
    }
    const double inverse_depth = hints.inverse_depth ? hints.inverse_depth(track.id) : 0.0;
    cameras[camera].ids.push_back(track.id);
    const PredictedView view = PredictView(model_, last, inverse_depth, motion->second);
    cameras[camera].requests.push_back({last.pixel, view.pixel.value_or(last.pixel)});
    cameras[camera].expected.push_back(inverse_depth > 0.0 ? view.pixel : std::nullopt);
    cameras[camera].changes.push_back({motion->second.R_earlier_current, view.nearer});
  }
  return cameras;
}

void PanoramicTracker::Follow(FrameId frame, const TrackingHints& hints, TrackingSummary& summary) {
  std::vector<CameraTracks> cameras = Predict(frame, hints);
  ParallelFor(cameras.size(), 1, [&](std::size_t i) {
    if (cameras[i].ids.empty()) return;
    cameras[i].results = TrackFlow(streams_[i].previous, streams_[i].current, cameras[i].requests,
                                   config_.pyramid, config_.flow);
  });
  const bool weighted = config_.refinement.enabled && config_.refinement.usual_sigma > 0.0;
  std::vector<Followed> followed;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (std::size_t i = 0; i < cameras[c].ids.size(); ++i) {
      const FlowResult& result = cameras[c].results[i];
      const bool tracked = result.status == FlowStatus::kTracked;
      auto observation = tracked ? model_.Lift(static_cast<int>(c), result.pixel) : std::nullopt;
      if (observation) {
        if (weighted) observation->sigma_scale = config_.refinement.flow_scale;
        followed.push_back(
            {{cameras[c].ids[i], *observation, cameras[c].changes[i]}, cameras[c].expected[i]});
        continue;
      }
      tracks_.End(cameras[c].ids[i]);
      ++summary.cameras[c].lost;
      ++(result.status == FlowStatus::kRoundTrip ? summary.round_trip : summary.lost);
    }
  }
  Extend(frame, followed, summary);
}

void PanoramicTracker::Extend(FrameId frame, std::span<const Followed> followed,
                              TrackingSummary& summary) {
  const std::vector<Refinement> refined = Refine(followed);
  std::vector<PanoramicObservation> places;
  for (std::size_t i = 0; i < followed.size(); ++i) {
    places.push_back(refined[i].observation.value_or(followed[i].request.observation));
  }
  const double limit = SurpriseLimit(followed, places);
  for (std::size_t i = 0; i < followed.size(); ++i) {
    const auto& expected = followed[i].expected;
    CameraTracking& camera = summary.cameras[static_cast<std::size_t>(places[i].camera)];
    const bool surprising = expected && (places[i].pixel - *expected).norm() > limit;
    if (refined[i].contradicts || surprising) {
      tracks_.End(followed[i].request.track);
      ++(refined[i].contradicts ? summary.contradicted : summary.surprising);
      ++(refined[i].contradicts ? camera.lost : camera.outliers);
      continue;
    }
    tracks_.Extend(followed[i].request.track, frame, places[i]);
    ++summary.followed;
    ++camera.followed;
    if (refined[i].observation) refined_.insert(followed[i].request.track);
  }
}

// px, for tracks whose depth is known.
double PanoramicTracker::SurpriseLimit(std::span<const Followed> followed,
                                       std::span<const PanoramicObservation> places) const {
  std::vector<double> surprises;
  for (std::size_t i = 0; i < followed.size(); ++i) {
    if (!followed[i].expected) continue;
    surprises.push_back((places[i].pixel - *followed[i].expected).norm());
  }
  return OutlierLimit(std::move(surprises), config_.prediction_limit_px,
                      config_.prediction_scatter);
}

std::vector<Refinement> PanoramicTracker::Refine(std::span<const Followed> followed) {
  std::vector<const ImagePyramid*> images;
  for (const Stream& stream : streams_) images.push_back(&stream.current);
  std::vector<RefinementRequest> requests;
  for (const Followed& track : followed) requests.push_back(track.request);
  return refiner_.Refine(model_, requests, images);
}

void PanoramicTracker::RejectOutliers(FrameId frame, const TrackingHints& hints,
                                      TrackingSummary& summary) {
  struct Group {
    std::vector<TrackId> ids;
    std::vector<RayPair> pairs;
  };
  // By the frame before: one group, unless a camera had missed some.
  std::map<FrameId, Group> groups;
  std::map<std::pair<FrameId, int>, Pose3> places;
  const auto place_of = [&](FrameId seen_in, int camera) -> const Pose3& {
    const auto [place, is_new] = places.try_emplace({seen_in, camera});
    if (is_new) place->second = ImagePlace(hints, seen_in, camera);
    return place->second;
  };
  for (const Track& track : tracks_.tracks()) {
    if (!track.alive || track.last_frame() != frame || track.observations.size() < 2) continue;
    const TrackObservation& before = track.observations[track.observations.size() - 2];
    // In the pano frame at the stamp of its set, from where the camera was at that of its image.
    const auto ray = [&](FrameId seen_in, const PanoramicObservation& o) {
      const Pose3& place = place_of(seen_in, o.camera);
      return Ray{place * o.center, place.rotation() * o.bearing,
                 config_.outlier_sigma_px / o.resolution()};
    };
    Group& group = groups[before.frame];
    group.ids.push_back(track.id);
    group.pairs.push_back({ray(before.frame, before.observation), ray(frame, track.last())});
  }
  for (const auto& [before, group] : groups) {
    const PredictedMotion motion = hints.motion(before);
    const RelativeTranslation result = EstimateRelativeTranslation(
        group.pairs, motion.R_earlier_current, motion.t_earlier_current, config_.outliers);
    for (std::size_t i = 0; i < group.ids.size(); ++i) {
      if (result.inliers[i] != 0) continue;
      RejectNewest(group.ids[i], summary.outliers, summary);
    }
  }
}

void PanoramicTracker::StartTracks(FrameId frame, TrackingSummary& summary) {
  std::vector<Eigen::Vector3d> features;
  for (const Track& track : tracks_.tracks()) {
    if (track.alive) features.push_back(track.last().point);
  }
  std::vector<std::vector<Corner>> corners(streams_.size());
  ParallelFor(streams_.size(), 1, [&](std::size_t i) {
    if (streams_[i].current.empty()) return;
    corners[i] = FindCorners(static_cast<int>(i), features);
  });
  for (const PanoramicObservation& observation : budget_.Select(model_, corners, features)) {
    const TrackId track = tracks_.Start(frame, observation, /*on_trial=*/true);
    refiner_.Start(track, observation,
                   streams_[static_cast<std::size_t>(observation.camera)].current);
    ++summary.started;
  }
}

// What an image has to offer for the parts of the sphere that want features.
std::vector<Corner> PanoramicTracker::FindCorners(int camera,
                                                  std::span<const Eigen::Vector3d> features) {
  const auto index = static_cast<std::size_t>(camera);
  const ImagePyramid& image = streams_[index].current;
  std::vector<std::uint8_t> occupied(static_cast<std::size_t>(budget_.cells().size()));
  for (const Eigen::Vector3d& feature : features) {
    occupied[static_cast<std::size_t>(budget_.CellOf(feature))] = 1;
  }
  const std::vector<std::uint8_t> wanted =
      budget_.WantedParts(features, turns_[index].Due(occupied));
  std::vector<Corner> corners =
      DetectCorners(image, budget_.regions(camera), wanted, config_.corner);
  JudgeCorners(image, config_.corner, config_.refinement.patch, corners);
  std::vector<std::uint8_t> looked_at(occupied.size()), with_corner(occupied.size());
  for (std::size_t part = 0; part < wanted.size(); ++part) {
    if (wanted[part] == 0) continue;
    looked_at[static_cast<std::size_t>(budget_.CellOfPart(static_cast<int>(part)))] = 1;
  }
  for (const Corner& corner : corners) {
    with_corner[static_cast<std::size_t>(budget_.CellOfPart(corner.region))] = 1;
  }
  turns_[index].Note(looked_at, with_corner);
  return corners;
}

// Most tracks that follow something else than a point of the scene (a crossing of near and far, a
// person) are lost or found out within a few sets of images, but not within the first one.
void PanoramicTracker::TrustTracks(FrameId frame, const TrackingHints& hints,
                                   TrackingSummary& summary) {
  std::vector<TrackId> on_trial;
  std::vector<int> of_length(static_cast<std::size_t>(config_.trial) + 1);  // by observations - 1
  for (const Track& track : tracks_.tracks()) {
    if (!track.alive || track.last_frame() != frame) continue;
    if (track.trusted()) {
      ++summary.trusted;
      continue;
    }
    on_trial.push_back(track.id);
    ++of_length[std::min(track.observations.size(), of_length.size()) - 1];
  }
  std::size_t needed = of_length.size();  // observations
  for (int trusted = summary.trusted; needed > 1; --needed) {
    trusted += of_length[needed - 1];
    if (trusted >= config_.least_trusted) break;
  }
  for (const TrackId id : on_trial) {
    const Track& track = *tracks_.Find(id);
    if (track.observations.size() < needed) continue;
    if (IsOnFixedPoint(track, hints)) {
      tracks_.Trust(id, frame);
      ++summary.trusted;
    } else {
      RejectNewest(id, summary.inconsistent, summary);
    }
  }
}

bool PanoramicTracker::IsOnFixedPoint(const Track& track, const TrackingHints& hints) const {
  const std::vector<Ray> rays = RaysOf(track, hints);
  return rays.size() < 3 || LargestMiss(rays) <= config_.trial_limit_px;
}

// Ends a track whose newest observation is an outlier.
void PanoramicTracker::RejectNewest(TrackId id, int& reason, TrackingSummary& summary) {
  CameraTracking& camera =
      summary.cameras[static_cast<std::size_t>(tracks_.Find(id)->last().camera)];
  tracks_.RejectLast(id);
  refined_.erase(id);
  ++reason;
  --summary.followed;
  ++camera.outliers;
  --camera.followed;
}

// Of all observations for which the motion since then is known, in the newest pano frame; sigmas
// are those of a pixel.
std::vector<Ray> PanoramicTracker::RaysOf(const Track& track, const TrackingHints& hints) const {
  std::vector<Ray> rays;
  for (const TrackObservation& o : track.observations) {
    const PredictedMotion motion = hints.motion(o.frame);
    if (!motion.t_earlier_current) continue;
    const Pose3 T = Pose3(motion.R_earlier_current, *motion.t_earlier_current).inverse() *
                    ImagePlace(hints, o.frame, o.observation.camera);
    rays.push_back({T * o.observation.center, T.rotation() * o.observation.bearing,
                    1.0 / o.observation.resolution()});
  }
  return rays;
}

void PanoramicTracker::Advance() {
  for (Stream& stream : streams_) {
    if (stream.current.empty()) continue;
    stream.previous = std::move(stream.current);
    stream.current = {};
    stream.previous_stamp = stream.current_stamp;
  }
}

}  // namespace mlvi

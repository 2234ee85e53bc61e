// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <set>
#include <span>
#include <vector>

#include "mlvi/features/corners.h"
#include "mlvi/features/flow.h"
#include "mlvi/panorama/cell_turns.h"
#include "mlvi/panorama/feature_budget.h"
#include "mlvi/panorama/relative_translation.h"
#include "mlvi/panorama/track_refiner.h"
#include "mlvi/panorama/track_store.h"

namespace mlvi {

struct PanoramicTrackerConfig {
  int budget = 250;
  int trial = 3;
  double trial_limit_px = 0.7;
  int least_trusted = 100;
  double outlier_sigma_px = 0.5;
  double max_gap = 1.0;
  double prediction_limit_px = 1.0;
  double prediction_scatter = 4.0;
  PyramidConfig pyramid;
  FlowConfig flow;
  RefinementConfig refinement;
  CornerConfig corner;
  RelativeTranslationConfig outliers;
  void Declare(ConfigDeclaration& d);
  // What ranges of single fields do not say: windows have a middle pixel. Errors: kConfiguration.
  Expected<void> Validate() const;
};

// Pose of the pano frame at the current images in that of an earlier frame, as the IMU predicts it.
struct PredictedMotion {
  Eigen::Quaterniond R_earlier_current = Eigen::Quaterniond::Identity();
  std::optional<Eigen::Vector3d> t_earlier_current;  // m
};

// What is known from outside when images arrive.
struct TrackingHints {
  // The motion from an earlier frame. Required.
  std::function<PredictedMotion(FrameId earlier)> motion;
  // Where the pano frame was at the instant of the image of `camera`, in the pano frame of `frame`:
  // the images of a set need not be of one instant. Empty: they are.
  std::function<Pose3(FrameId frame, int camera)> image_place;
  // Inverse depth (1/m) of a track along the ray of its last observation; 0 when unknown. May be
  // empty.
  std::function<double(TrackId)> inverse_depth;
};

// The share of one camera.
struct CameraTracking {
  int followed = 0;
  int lost = 0;      // round trips and contradictions included
  int outliers = 0;  // against motion and depths: surprising and inconsistent ones included
  int alive = 0;
};

struct TrackingSummary {
  int followed = 0;      // tracks that got an observation
  int refined = 0;       // of these, aligned with the window of an earlier image
  int lost = 0;          // no texture, left the picture or what is usable of it
  int round_trip = 0;    // tracking back ended elsewhere
  int contradicted = 0;  // flow and alignment disagree
  int surprising = 0;    // not where depth and motion have them
  int inconsistent = 0;  // on no fixed point while on trial
  int outliers = 0;      // against the common motion
  int started = 0;
  int trusted = 0;  // tracks with an observation that estimators count
  std::vector<CameraTracking> cameras;
};

// From the images of all cameras to the tracks of the sphere: flow from predicted places,
// forward-backward check, alignment with the window of the first image, one RANSAC, new features in
// empty cells. Tracks are on trial first: what follows no point of the scene is found out within a
// few sets. Cameras run in parallel and may come and go: one without an image keeps its tracks
// for `max_gap`.
class PanoramicTracker {
 public:
  // The model is copied; set_model replaces it when calibration changes (lens models and masks
  // stay).
  PanoramicTracker(const PanoramaModel& model, const PanoramicTrackerConfig& config);

  // `images`: at most one per camera, of about one instant; `frame` must rise.
  TrackingSummary Process(FrameId frame, std::span<const Image> images, const TrackingHints& hints);

  const TrackStore& tracks() const { return tracks_; }
  TrackStore& tracks() { return tracks_; }  // the estimator forgets frames
  const PanoramaModel& model() const { return model_; }
  void set_model(const PanoramaModel& model) { model_ = model; }
  const FeatureBudget& budget() const { return budget_; }

 private:
  // The images of one camera now and before.
  struct Stream {
    ImagePyramid previous, current;
    Time previous_stamp, current_stamp;
  };

  // The living tracks of one camera with an image and what flow made of them.
  struct CameraTracks {
    std::vector<TrackId> ids;
    std::vector<FlowRequest> requests;
    std::vector<ViewChange> changes;
    std::vector<std::optional<Eigen::Vector2d>> expected;  // px, where the depth is known
    std::vector<FlowResult> results;
  };

  // A track that flow has followed.
  struct Followed {
    RefinementRequest request;
    std::optional<Eigen::Vector2d> expected;
  };

  void BuildPyramids(std::span<const Image> images);
  void EndStaleTracks();
  std::vector<CameraTracks> Predict(FrameId frame, const TrackingHints& hints) const;
  void Follow(FrameId frame, const TrackingHints& hints, TrackingSummary& summary);
  void Extend(FrameId frame, std::span<const Followed> followed, TrackingSummary& summary);
  double SurpriseLimit(std::span<const Followed> followed,
                       std::span<const PanoramicObservation> places) const;
  std::vector<Refinement> Refine(std::span<const Followed> followed);
  void RejectOutliers(FrameId frame, const TrackingHints& hints, TrackingSummary& summary);
  void StartTracks(FrameId frame, TrackingSummary& summary);
  void TrustTracks(FrameId frame, const TrackingHints& hints, TrackingSummary& summary);
  bool IsOnFixedPoint(const Track& track, const TrackingHints& hints) const;
  void RejectNewest(TrackId id, int& reason, TrackingSummary& summary);
  std::vector<Ray> RaysOf(const Track& track, const TrackingHints& hints) const;
  std::vector<Corner> FindCorners(int camera, std::span<const Eigen::Vector3d> features);
  void Advance();

  PanoramaModel model_;
  PanoramicTrackerConfig config_;
  FeatureBudget budget_;
  TrackStore tracks_;
  TrackRefiner refiner_;
  std::set<TrackId> refined_;     // those of TrackingSummary, in the present set
  std::vector<CellTurns> turns_;  // per camera
  std::vector<Stream> streams_;   // per camera
};

}  // namespace mlvi

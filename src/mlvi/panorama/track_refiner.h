// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "mlvi/features/patch.h"
#include "mlvi/panorama/panorama_model.h"
#include "mlvi/panorama/track_store.h"

namespace mlvi {

struct RefinementConfig {
  bool enabled = true;
  double max_stretch = 1.4;
  double renew_correlation = 0.9;
  double usual_sigma = 0.06;
  double flow_scale = 2.0;
  double max_disagreement_px = 0.8;
  PatchConfig patch;
  void Declare(ConfigDeclaration& d);
};

// How the view of a track changed since its last observation, as predicted.
struct ViewChange {
  Eigen::Quaterniond R_last_current = Eigen::Quaterniond::Identity();  // of the pano frame
  double nearer = 1.0;  // distance at the last observation / distance now; 1 when unknown
};

// Where flow put a track, to be refined.
struct RefinementRequest {
  TrackId track;
  PanoramicObservation observation;
  ViewChange change;
};

// What alignment says of a place found by flow.
struct Refinement {
  // On the spot where the window says; empty where it cannot tell, and flow has to be believed.
  std::optional<PanoramicObservation> observation;
  // The window is there, but farther from where flow went than both err: at a rim they follow
  // different surfaces, on a pane what is behind it and what is mirrored.
  bool contradicts = false;
};

// Keeps tracks on their points: flow from image to image errs anew in each, so every track is
// aligned with the window that it had when it was first seen, warped as rotation and lens have it
// and as the surface has turned out to be.
// When the view has changed too much for that, the window is renewed.
class TrackRefiner {
 public:
  explicit TrackRefiner(const RefinementConfig& config) : config_(config) {}

  // Cuts the window of a new track.
  void Start(TrackId track, const PanoramicObservation& observation, const ImagePyramid& image);
  // One per request and in their order. `images`: per camera.
  std::vector<Refinement> Refine(const PanoramaModel& model,
                                 std::span<const RefinementRequest> requests,
                                 std::span<const ImagePyramid* const> images);
  // Forgets windows of tracks that are no longer followed.
  void Keep(const TrackStore& tracks);

 private:
  struct Reference {
    Patch patch;
    PanoramicObservation observation;  // where it was cut
    Eigen::Quaterniond R_reference_last = Eigen::Quaterniond::Identity();
    double nearer = 1.0;  // distance there / distance at the last observation
    // What the predicted warp lacked: slant and distance of the surface.
    Eigen::Matrix2d correction = Eigen::Matrix2d::Identity();
  };

  Refinement RefineOne(const PanoramaModel& model, const RefinementRequest& request,
                       const ImagePyramid& image, std::optional<Reference>& reference) const;
  std::optional<Reference> Cut(const PanoramicObservation& observation,
                               const ImagePyramid& image) const;

  RefinementConfig config_;
  std::map<TrackId, std::optional<Reference>> references_;
};

}  // namespace mlvi

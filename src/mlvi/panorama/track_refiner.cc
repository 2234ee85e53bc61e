// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_refiner.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>

#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

// Small pixel differences around `from` to those around `to`, when the view has turned: pixel ->
// bearing -> turned -> pixel. P^T (P P^T)^-1 inverts pixel_per_bearing on the tangent plane.
Eigen::Matrix2d WarpBetween(const PanoramicObservation& from, const PanoramicObservation& to,
                            const Eigen::Quaterniond& R_from_to) {
  const auto& P = from.pixel_per_bearing;
  const Eigen::Matrix<double, 3, 2> bearing_per_pixel =
      P.transpose() * (P * P.transpose()).inverse();
  return to.pixel_per_bearing * (R_from_to.conjugate().toRotationMatrix() * bearing_per_pixel);
}

// The largest stretch or shrinkage of the warp, as a factor above 1.
double StretchOf(const Eigen::Matrix2d& warp) {
  const Eigen::Vector2d values = Eigen::JacobiSVD<Eigen::Matrix2d>(warp).singularValues();
  return std::max(values[0], 1.0 / values[1]);
}

// Limits of what the uncertainty of an observation may be in units of the usual one.
constexpr double kLeastScale = 0.5, kMostScale = 4.0;

}  // namespace

void RefinementConfig::Declare(ConfigDeclaration& d) {
  d.Field("enabled", enabled, "Align each track with the window of its first image");
  d.Field("max_stretch", max_stretch, "",
          "Windows stretched or shrunk by more than this factor are renewed", {1.0, 10.0});
  d.Field("renew_correlation", renew_correlation, "",
          "Windows that correlate less than this are renewed where they are found", {0.0, 1.0});
  d.Field("usual_sigma", usual_sigma, "px",
          "What alignments say of their own uncertainty on the whole: one that says twice as much "
          "counts as twice as uncertain; 0: all count the same",
          {0.0, 10.0});
  d.Field("flow_scale", flow_scale, "",
          "Uncertainty, in units of the usual one, where alignment fails and flow is believed",
          {0.1, 100.0});
  d.Field("max_disagreement_px", max_disagreement_px, "px",
          "A track ends where its window is found farther than this from where flow went",
          {0.01, 20.0});
  d.Section("patch", patch);
}

std::optional<TrackRefiner::Reference> TrackRefiner::Cut(const PanoramicObservation& observation,
                                                         const ImagePyramid& image) const {
  auto patch = Patch::Cut(image, observation.pixel, config_.patch);
  if (!patch) return std::nullopt;
  return Reference{.patch = std::move(*patch), .observation = observation};
}

void TrackRefiner::Start(TrackId track, const PanoramicObservation& observation,
                         const ImagePyramid& image) {
  if (config_.enabled) references_[track] = Cut(observation, image);
}

std::vector<Refinement> TrackRefiner::Refine(const PanoramaModel& model,
                                             std::span<const RefinementRequest> requests,
                                             std::span<const ImagePyramid* const> images) {
  std::vector<Refinement> refined(requests.size());
  if (!config_.enabled) return refined;
  std::vector<std::optional<Reference>*> references;
  for (const RefinementRequest& request : requests)
    references.push_back(&references_[request.track]);
  ParallelFor(requests.size(), 16, [&](std::size_t i) {
    const auto camera = static_cast<std::size_t>(requests[i].observation.camera);
    refined[i] = RefineOne(model, requests[i], *images[camera], *references[i]);
  });
  return refined;
}

Refinement TrackRefiner::RefineOne(const PanoramaModel& model, const RefinementRequest& request,
                                   const ImagePyramid& image,
                                   std::optional<Reference>& reference) const {
  if (!reference) {
    reference = Cut(request.observation, image);
    return {};
  }
  reference->R_reference_last = reference->R_reference_last * request.change.R_last_current;
  reference->nearer *= request.change.nearer;
  const Eigen::Matrix2d predicted =
      reference->nearer *
      WarpBetween(reference->observation, request.observation, reference->R_reference_last);
  const auto match = reference->patch.Align(image, predicted * reference->correction,
                                            request.observation.pixel, config_.patch);
  const bool found =
      match && match->converged && match->correlation >= config_.patch.min_correlation;
  auto refined = found ? model.Lift(request.observation.camera, match->pixel) : std::nullopt;
  if (refined && config_.usual_sigma > 0.0) {
    refined->sigma_scale =
        std::clamp(match->sigma() / config_.usual_sigma, kLeastScale, kMostScale);
  }
  const bool worn = !refined || match->correlation < config_.renew_correlation ||
                    StretchOf(match->warp) > config_.max_stretch;
  if (worn) {
    reference = Cut(refined.value_or(request.observation), image);
  } else {
    reference->correction = predicted.inverse() * match->warp;
  }
  const bool contradicts =
      found && (match->pixel - request.observation.pixel).norm() > config_.max_disagreement_px;
  return {.observation = refined, .contradicts = contradicts};
}

void TrackRefiner::Keep(const TrackStore& tracks) {
  std::erase_if(references_, [&](const auto& entry) {
    const Track* track = tracks.Find(entry.first);
    return track == nullptr || !track->alive;
  });
}

}  // namespace mlvi

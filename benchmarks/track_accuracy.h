// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracks against the truth of a simulated sequence: the surface that an observation of a track lies
// on is traced, and its point seen from a later pose. Textured surfaces, rims of things, panes and
// what moves are told apart. On a pane a track may follow the pane, what is seen through it, or a
// mirror image (a fixed point behind a plane pane, too), at the rim of a thing this thing or what is
// behind it, whatever the middle of the window just lies on: the one that it stays nearest to over
// all its life counts. Tracks that estimators never counted do not count here, of the others all
// observations do.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/panorama/track_store.h"
#include "mlvi/sim/recording.h"
#include "quantile.h"

namespace mlvi {

class TrackAccuracy {
 public:
  enum Kind : int { kSurface, kRim, kPane, kThrough, kMirrored, kMoving, kAll, kKinds };
  static std::string NameOf(int kind) {
    static constexpr std::array<const char*, kKinds> kNames = {
        "surface", "rim", "pane", "seen through", "mirrored", "moving", "all"};
    return kNames[static_cast<std::size_t>(kind)];
  }

  struct Row {
    std::string kind;
    int tracks = 0, observations = 0;
    double share = 0.0;               // of all observations
    double step = 0.0, step_1 = 0.0;  // px from set to set: median; share beyond 1 px
    double strict_1 = 0.0;            // the same with what the pixel lies on as the only truth
    // Over kSpan sets, or since the first observation where that is nearer:
    double median = 0.0, p90 = 0.0;         // px
    double beyond_1 = 0.0, beyond_3 = 0.0;  // shares of observations
    double whole_median = 0.0;              // px, since the first observation
    double short_lived = 0.0;               // share of tracks that end before kSpan sets
    double beyond_1_young = 0.0;            // share of tracks, kSpan sets after the first one
  };
  static constexpr std::size_t kSpan = 8;

  // Both must outlive this. `model` holds the true mounts.
  TrackAccuracy(const Recording& recording, const PanoramaModel& model)
      : recording_(&recording), model_(&model) {}

  // After each set of images, taken at the true instant `time`: what the tracks saw in it.
  void Observe(Time time, std::span<const Track> tracks) {
    FrameId frame;
    for (const Track& track : tracks) frame = std::max(frame, track.last_frame());
    if (frame <= newest_) return;  // nothing was seen in this set
    newest_ = frame;
    const WorldSnapshot world = recording_->world().At(time);
    const Pose3 T_world_pano = recording_->GroundTruth(time).T_world_body * model_->T_body_pano();
    for (const Track& track : tracks) {
      if (track.last_frame() != frame) continue;
      // The rig as it is, whatever an estimator that calibrates believes.
      const auto seen = model_->Lift(track.last().camera, track.last().pixel);
      if (!seen) continue;
      const PanoramicObservation& o = *seen;
      const auto [entry, is_new] = followed_.try_emplace(track.id);
      Followed& followed = entry->second;
      followed.trusted = track.trusted();
      if (is_new) {
        followed.kind = KindAt(world, T_world_pano, o);
        followed.first = PointsAt(world, T_world_pano, o);
        followed.last = {followed.first};
        continue;
      }
      followed.whole.push_back(ErrorsOf(followed.first, T_world_pano, o));
      followed.errors.push_back(ErrorsOf(followed.last.front(), T_world_pano, o));
      followed.steps.push_back(ErrorsOf(followed.last.back(), T_world_pano, o));
      followed.last.push_back(PointsAt(world, T_world_pano, o));
      if (followed.last.size() > kSpan) followed.last.pop_front();
    }
  }

  // One row per kind that occurred, the last of all together. Tracks that went on when the sequence
  // ended count as short-lived, too, if they were young: few.
  std::vector<Row> Rows() const {
    std::array<Collected, kKinds> all;
    for (const auto& [id, followed] : followed_) {
      if (!followed.trusted) continue;
      const std::size_t candidate = followed.Candidate();
      Add(followed, candidate, all[static_cast<std::size_t>(followed.KindOf(candidate))]);
      Add(followed, candidate, all[kAll]);
    }
    std::vector<Row> rows;
    for (int kind = 0; kind < kKinds; ++kind) {
      const Collected& c = all[static_cast<std::size_t>(kind)];
      if (c.tracks > 0) rows.push_back(RowOf(kind, c, all[kAll].errors.size()));
    }
    return rows;
  }

 private:
  // The surface, what is behind it, a mirror image; the nearest and the farthest surface around.
  static constexpr std::size_t kCandidates = 5, kOnThePixel = 3;
  static constexpr double kNothing = 99.0;  // px, where there is no such candidate
  static constexpr double kFar = 1000.0;    // m, of the sky
  using Points = std::array<std::optional<Eigen::Vector3d>, kCandidates>;  // world
  using Errors = std::array<double, kCandidates>;                          // px

  struct Followed {
    Kind kind = kSurface;
    bool trusted = false;
    Points first;
    std::deque<Points> last;  // at the last kSpan observations
    std::vector<Errors> whole, errors, steps;

    // The one of the first `candidates` that the track stayed nearest to.
    std::size_t Candidate(std::size_t candidates = kCandidates) const {
      Errors sum = {};
      for (const Errors& e : errors) {
        for (std::size_t i = 0; i < candidates; ++i) sum[i] += std::min(e[i], 5.0);
      }
      const auto end = sum.begin() + static_cast<std::ptrdiff_t>(candidates);
      return static_cast<std::size_t>(std::min_element(sum.begin(), end) - sum.begin());
    }
    Kind KindOf(std::size_t candidate) const {
      constexpr std::array<Kind, kCandidates> kOnPanes = {kPane, kThrough, kMirrored, kPane, kPane};
      return kind == kPane ? kOnPanes[candidate] : kind;
    }
  };

  struct Collected {
    int tracks = 0, short_lived = 0, grown = 0, grown_beyond_1 = 0;
    std::vector<double> whole, errors, steps, strict_steps;
  };

  static bool IsPane(const Material& material) {
    return material.transmission > 0.0 || material.mirror >= 0.06;
  }

  // What is around the pixel decides: a window of the tracker sees it, too.
  Kind KindAt(const WorldSnapshot& world, const Pose3& T_world_pano,
              const PanoramicObservation& o) const {
    const Eigen::Vector3d origin = T_world_pano * o.center;
    const Eigen::Vector3d middle = T_world_pano.rotation() * o.bearing;
    const auto hit = world.Cast(origin, middle, kFar);
    bool rim = false, pane = hit && IsPane(*hit->material), moving = hit && hit->object >= 0;
    const Eigen::Matrix<double, 3, 2> tangent = TangentBasis(middle);
    for (int i = 0; i < 24; ++i) {
      const double angle = M_PI / 6.0 * i, reach = (i % 2 == 0 ? 2.0 : 4.0) / o.resolution();
      const Eigen::Vector3d d =
          (middle + reach * tangent * Eigen::Vector2d(std::cos(angle), std::sin(angle)))
              .normalized();
      const auto near = world.Cast(origin, d, kFar);
      if (near.has_value() != hit.has_value()) rim = true;
      if (!near || !hit) continue;
      // Where the tangent plane of the middle is met.
      const double plane = hit->range * middle.dot(hit->normal) / d.dot(hit->normal);
      rim |= std::abs(near->range - plane) > 0.05 * hit->range;
      pane |= IsPane(*near->material);
      moving |= near->object >= 0;
    }
    return moving ? kMoving : pane ? kPane : rim ? kRim : kSurface;
  }

  // Of the surfaces that a window of the tracker holds, continued to its middle.
  static std::pair<double, double> RangesAround(const WorldSnapshot& world,
                                                const Eigen::Vector3d& origin,
                                                const Eigen::Vector3d& middle,
                                                const std::optional<SurfaceHit>& hit,
                                                double resolution) {
    const double own = hit ? hit->range : kFar;
    std::pair<double, double> ranges(own, own);
    const Eigen::Matrix<double, 3, 2> tangent = TangentBasis(middle);
    for (int i = 0; i < 36; ++i) {
      const double angle = M_PI / 6.0 * (i / 3), reach = 2.0 * (1 + i % 3) / resolution;
      const Eigen::Vector3d d =
          (middle + reach * tangent * Eigen::Vector2d(std::cos(angle), std::sin(angle)))
              .normalized();
      const auto around = world.Cast(origin, d, kFar);
      double range = kFar;
      if (around) {
        const double plane = around->range * d.dot(around->normal) / middle.dot(around->normal);
        range = std::clamp(plane, 0.8 * around->range, 1.25 * around->range);
      }
      if (std::abs(range - own) < 0.05 * own) continue;
      ranges = {std::min(ranges.first, range), std::max(ranges.second, range)};
    }
    return ranges;
  }

  Points PointsAt(const WorldSnapshot& world, const Pose3& T_world_pano,
                  const PanoramicObservation& o) const {
    const Eigen::Vector3d origin = T_world_pano * o.center;
    const Eigen::Vector3d direction = T_world_pano.rotation() * o.bearing;
    const auto hit = world.Cast(origin, direction, kFar);
    Points points;
    points[0] = origin + (hit ? hit->range : kFar) * direction;
    const auto [nearest, farthest] = RangesAround(world, origin, direction, hit, o.resolution());
    points[3] = origin + nearest * direction;
    points[4] = origin + farthest * direction;
    if (!hit || !IsPane(*hit->material)) return points;
    constexpr double kBehind = 1e-3;  // m, on the far side of the pane
    const auto through = world.Cast(*points[0] + kBehind * direction, direction, kFar);
    points[1] = *points[0] + (through ? through->range + kBehind : kFar) * direction;
    const Eigen::Vector3d mirrored = direction - 2.0 * direction.dot(hit->normal) * hit->normal;
    const auto image = world.Cast(*points[0] + kBehind * hit->normal, mirrored, kFar);
    points[2] = *points[0] + (image ? image->range : kFar) * direction;
    return points;
  }

  Errors ErrorsOf(const Points& points, const Pose3& T_world_pano,
                  const PanoramicObservation& o) const {
    Errors errors;
    for (std::size_t i = 0; i < kCandidates; ++i) {
      errors[i] = kNothing;
      if (!points[i]) continue;
      const auto pixel = model_->ProjectPoint(o.camera, T_world_pano.inverse() * *points[i]);
      if (pixel) errors[i] = (*pixel - o.pixel).norm();
    }
    return errors;
  }

  static void Add(const Followed& followed, std::size_t candidate, Collected& all) {
    ++all.tracks;
    all.short_lived += followed.errors.size() < kSpan ? 1 : 0;
    for (const Errors& e : followed.whole) all.whole.push_back(e[candidate]);
    for (const Errors& e : followed.errors) all.errors.push_back(e[candidate]);
    const std::size_t on_the_pixel = followed.Candidate(kOnThePixel);
    for (const Errors& e : followed.steps) {
      all.steps.push_back(e[candidate]);
      all.strict_steps.push_back(e[on_the_pixel]);
    }
    if (followed.errors.size() < kSpan) return;
    ++all.grown;
    all.grown_beyond_1 += followed.errors[kSpan - 1][candidate] > 1.0 ? 1 : 0;
  }

  static double Beyond(const std::vector<double>& values, double limit) {
    if (values.empty()) return 0.0;
    return static_cast<double>(
               std::count_if(values.begin(), values.end(), [&](double v) { return v > limit; })) /
           static_cast<double>(values.size());
  }

  static Row RowOf(int kind, const Collected& c, std::size_t all) {
    return {.kind = NameOf(kind),
            .tracks = c.tracks,
            .observations = static_cast<int>(c.errors.size()),
            .share = static_cast<double>(c.errors.size()) /
                     static_cast<double>(std::max<std::size_t>(all, 1)),
            .step = Quantile(c.steps, 0.5),
            .step_1 = Beyond(c.steps, 1.0),
            .strict_1 = Beyond(c.strict_steps, 1.0),
            .median = Quantile(c.errors, 0.5),
            .p90 = Quantile(c.errors, 0.9),
            .beyond_1 = Beyond(c.errors, 1.0),
            .beyond_3 = Beyond(c.errors, 3.0),
            .whole_median = Quantile(c.whole, 0.5),
            .short_lived = c.short_lived / static_cast<double>(c.tracks),
            .beyond_1_young = c.grown_beyond_1 / static_cast<double>(std::max(c.grown, 1))};
  }

  const Recording* recording_;
  const PanoramaModel* model_;
  FrameId newest_;
  std::map<TrackId, Followed> followed_;
};

}  // namespace mlvi

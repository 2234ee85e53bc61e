// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "mlvi/base/id.h"
#include "mlvi/base/time.h"
#include "mlvi/panorama/panorama_model.h"

namespace mlvi {

using TrackId = Id<struct TrackTag>;
using FrameId = Id<struct FrameTag>;  // a set of images; rises with time

struct TrackObservation {
  FrameId frame;
  PanoramicObservation observation;
};

// One feature over time: where the rig saw it, oldest first, at most once per frame and camera.
struct Track {
  TrackId id;
  bool alive = true;  // still followed
  // From when on estimators count it, all of its observations; invalid while it is on trial.
  FrameId trusted_since;
  std::vector<TrackObservation> observations;

  const PanoramicObservation& last() const { return observations.back().observation; }
  FrameId last_frame() const { return observations.back().frame; }
  bool trusted() const { return trusted_since.valid(); }
  // The number of different frames.
  int frames() const;
};

// All tracks of the whole sphere, of whatever camera, in the order of their ids: the one place
// where features live. The tracker starts and extends tracks, the estimator reads them and forgets
// frames that leave its window.
class TrackStore {
 public:
  // Starts a track, trusted unless `on_trial`; ids count up and are never used again.
  TrackId Start(FrameId frame, const PanoramicObservation& observation, bool on_trial = false);
  // Ends the trial of a track with an observation in `frame`, the newest.
  void Trust(TrackId id, FrameId frame);
  // Adds an observation to a living track. Frames must not fall; a second camera may see it in the
  // same frame.
  void Extend(TrackId id, FrameId frame, const PanoramicObservation& observation);
  // Ends a track; its observations stay until their frames are forgotten.
  void End(TrackId id);
  // Ends a track and takes back its last observation, an outlier. A track without observations
  // vanishes.
  void RejectLast(TrackId id);
  // Forgets all observations of a frame, and tracks that have none left.
  void ForgetFrame(FrameId frame);
  // Forgets all observations before `frame`, and tracks that have none left.
  void ForgetBefore(FrameId frame);

  std::span<const Track> tracks() const { return tracks_; }
  const Track* Find(TrackId id) const;  // null when unknown or forgotten
  int alive() const;

 private:
  Track& Get(TrackId id);
  void EraseEmpty();

  std::vector<Track> tracks_;  // by rising id
  std::int64_t next_id_ = 0;
};

}  // namespace mlvi

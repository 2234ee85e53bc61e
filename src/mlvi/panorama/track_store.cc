// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/track_store.h"

#include <algorithm>

namespace mlvi {
namespace {

template <typename Tracks>
auto LowerBound(Tracks& tracks, TrackId id) {
  return std::lower_bound(tracks.begin(), tracks.end(), id,
                          [](const Track& track, TrackId wanted) { return track.id < wanted; });
}

}  // namespace

int Track::frames() const {
  int count = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    count += i == 0 || observations[i].frame != observations[i - 1].frame ? 1 : 0;
  }
  return count;
}

Track& TrackStore::Get(TrackId id) {
  const auto track = LowerBound(tracks_, id);
  MLVI_CHECK(track != tracks_.end() && track->id == id, "unknown track {}", id.value());
  return *track;
}

TrackId TrackStore::Start(FrameId frame, const PanoramicObservation& observation, bool on_trial) {
  const TrackId id(next_id_++);
  tracks_.push_back({.id = id,
                     .trusted_since = on_trial ? FrameId() : frame,
                     .observations = {{frame, observation}}});
  return id;
}

void TrackStore::Trust(TrackId id, FrameId frame) {
  Track& track = Get(id);
  MLVI_CHECK(!track.trusted() && track.last_frame() == frame,
             "track {}, last seen in frame {}, trusted since {}: trusted in {}", id.value(),
             track.last_frame().value(), track.trusted_since.value(), frame.value());
  track.trusted_since = frame;
}

void TrackStore::Extend(TrackId id, FrameId frame, const PanoramicObservation& observation) {
  Track& track = Get(id);
  MLVI_CHECK(track.alive, "track {} has ended", id.value());
  MLVI_CHECK(frame >= track.last_frame(), "frame {} after frame {}", frame.value(),
             track.last_frame().value());
  track.observations.push_back({frame, observation});
}

void TrackStore::End(TrackId id) { Get(id).alive = false; }

void TrackStore::RejectLast(TrackId id) {
  Track& track = Get(id);
  track.alive = false;
  track.observations.pop_back();
  if (track.observations.empty()) tracks_.erase(LowerBound(tracks_, id));
}

void TrackStore::ForgetFrame(FrameId frame) {
  for (Track& track : tracks_) {
    std::erase_if(track.observations, [&](const TrackObservation& o) { return o.frame == frame; });
  }
  EraseEmpty();
}

void TrackStore::ForgetBefore(FrameId frame) {
  for (Track& track : tracks_) {
    std::erase_if(track.observations, [&](const TrackObservation& o) { return o.frame < frame; });
  }
  EraseEmpty();
}

void TrackStore::EraseEmpty() {
  std::erase_if(tracks_, [](const Track& track) { return track.observations.empty(); });
}

const Track* TrackStore::Find(TrackId id) const {
  const auto track = LowerBound(tracks_, id);
  return track != tracks_.end() && track->id == id ? &*track : nullptr;
}

int TrackStore::alive() const {
  return static_cast<int>(
      std::count_if(tracks_.begin(), tracks_.end(), [](const Track& t) { return t.alive; }));
}

}  // namespace mlvi

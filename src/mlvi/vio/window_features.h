// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Bookkeeping of the window's features: observations in and out, anchors, first depths.
#pragma once

#include <vector>

#include "mlvi/vio/window.h"

namespace mlvi {

// T_world_body at the instant of the image of one camera in `frame`, as estimated.
Pose3 BodyAtImage(const VioWindow& window, FrameId frame, int camera);

// Takes over what the tracks saw in `frame`, which must be in the window; of those trusted since
// then what they saw in the window's earlier frames, too.
void AddObservations(VioWindow& window, FrameId frame, const TrackStore& tracks);

// Depths of features that have none yet: by triangulation where the parallax suffices, else
// `config.initial_depth`.
void InitializeDepths(VioWindow& window, const WindowConfig& config);

// Takes the observations of `frame` away. Features anchored there are anchored at their next
// observation, at the depth that their point has from it; those without any left are dropped. The
// frame must still be in the window.
void ForgetObservations(VioWindow& window, FrameId frame, const WindowConfig& config);

// Removes features whose error is beyond config.outlier_sigmas; returns those of their tracks that
// are still followed.
std::vector<TrackId> RemoveOutliers(VioWindow& window, const WindowConfig& config);

// What the inverse depth of a feature along its first ray is along that of observations[index].
double InverseDepthAt(const WindowFeature& feature, std::size_t index, const VioWindow& window,
                      const WindowConfig& config);

// The inverse depth of a track along the ray of its last observation in the window; 0 when unknown.
double TrackInverseDepth(const VioWindow& window, TrackId track, const WindowConfig& config);

// Notes a depth (m, along the ray of the last observation from its camera) that LiDAR has measured,
// as a measurement along the anchor's ray.
void SetLidarDepth(WindowFeature& feature, double depth, double sigma, const VioWindow& window,
                   const WindowConfig& config);

// The anchor becomes observations[index]; earlier ones are dropped.
void AnchorAt(WindowFeature& feature, std::size_t index, const VioWindow& window,
              const WindowConfig& config);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/lio/deskew.h"
#include "mlvi/lio/deskew_error.h"
#include "mlvi/lio/lio_config.h"

namespace mlvi {

// What a sweep offers to registration and to the map, in the body frame at `stamp`.
struct SweepFeatures {
  Time stamp;
  PointCloud planes;      // registered point to plane
  PointCloud edges;       // registered point to line; empty in the dense variant
  PointCloud map_planes;  // inserted into the map of planes
  PointCloud map_edges;   // inserted into the map of edges
  PointCloud marks;  // what interrupts the surfaces along a weak axis (marks.h), if there is one
  PointCloud cloud;  // the whole sweep, thinned, for those who ask for it
  // Of each point of `planes` and `edges`: the share of the sweep's span between its firing and the
  // last one, in [0, 1].
  std::vector<float> plane_lags, edge_lags;
  DeskewError deskew;  // what is known of the motion within the sweep; nothing unknown by default
  std::string note;    // why the variant asked for was not possible; empty otherwise
};

// Features of a deskewed sweep by the variant of `config`. Edges need rings: a sweep without them
// is registered in the dense variant, and the note says so.
SweepFeatures ExtractFeatures(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                              const LidarSpec& lidar, const LioConfig& config);

// The marks of a deskewed sweep along `axis` (body frame, unit).
PointCloud ExtractMarks(const DeskewedSweep& deskewed, const Eigen::Vector3d& axis,
                        const LidarSpec& lidar, const MarkConfig& config);

}  // namespace mlvi

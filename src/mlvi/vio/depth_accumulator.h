// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/state/estimates.h"
#include "mlvi/vio/depth_config.h"

namespace mlvi {

// The sweeps of the last seconds in world, one point per voxel: the newest. A single sweep is
// sparse; several cover what the cameras see, and old ones would blur what moves.
class DepthAccumulator {
 public:
  explicit DepthAccumulator(const DepthConfig& config) : config_(config) {}

  // Adds a deskewed sweep in world coordinates; forgets points that were last seen more than
  // config.span before it. Stamps must not fall.
  void Add(Time stamp, std::span<const Eigen::Vector3f> points_world);
  void Clear();

  // In no meaningful order; the same for the same calls.
  const PointCloud& points() const { return points_; }

 private:
  void ForgetBefore(Time oldest);

  DepthConfig config_;
  PointCloud points_;
  std::vector<Time> stamps_;                                // of `points_`
  std::unordered_map<std::uint64_t, std::uint32_t> index_;  // of the point in a voxel
  Time last_;
};

}  // namespace mlvi

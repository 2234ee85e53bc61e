// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_accumulator.h"

#include "mlvi/base/error.h"
#include "mlvi/spatial/voxel_key.h"

namespace mlvi {

void DepthAccumulator::Add(Time stamp, std::span<const Eigen::Vector3f> points_world) {
  MLVI_CHECK(stamp >= last_, "sweep at {} after one at {}", ToString(stamp), ToString(last_));
  last_ = stamp;
  ForgetBefore(stamp - Duration::FromSeconds(config_.span));
  const auto inverse_size = static_cast<float>(1.0 / config_.voxel_size);
  for (const Eigen::Vector3f& point : points_world) {
    const std::uint64_t key = VoxelKey::Of(point, inverse_size).bits();
    const auto [entry, is_new] =
        index_.try_emplace(key, static_cast<std::uint32_t>(points_.size()));
    if (is_new) {
      points_.push_back(point);
      stamps_.push_back(stamp);
    } else {
      points_[entry->second] = point;
      stamps_[entry->second] = stamp;
    }
  }
}

// The last point takes the place of one that is forgotten, so that no other one moves.
void DepthAccumulator::ForgetBefore(Time oldest) {
  const auto inverse_size = static_cast<float>(1.0 / config_.voxel_size);
  const auto key = [&](std::size_t i) { return VoxelKey::Of(points_[i], inverse_size).bits(); };
  for (std::size_t i = 0; i < points_.size();) {
    if (stamps_[i] >= oldest) {
      ++i;
      continue;
    }
    index_.erase(key(i));
    points_[i] = points_.back();
    stamps_[i] = stamps_.back();
    points_.pop_back();
    stamps_.pop_back();
    if (i < points_.size()) index_[key(i)] = static_cast<std::uint32_t>(i);
  }
}

void DepthAccumulator::Clear() {
  points_.clear();
  stamps_.clear();
  index_.clear();
  last_ = Time();
}

}  // namespace mlvi

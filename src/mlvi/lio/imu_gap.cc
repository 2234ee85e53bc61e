// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/imu_gap.h"

#include <algorithm>

namespace mlvi {

double SilentTime(std::span<const ImuSample> samples, Time from, Time to, double rate_hz) {
  const Duration limit =
      Duration::FromSeconds(std::max(0.025, rate_hz > 0.0 ? 5.0 / rate_hz : 0.0));
  Duration silent;
  ImuSample previous{.stamp = from};
  const auto close = [&](const ImuSample& next) {
    const Duration pause =
        std::max({next.stamp - previous.stamp, previous.interpolated_over, next.interpolated_over});
    if (pause > limit)
      silent = silent + (std::min(next.stamp, to) - std::max(previous.stamp, from));
  };
  for (const ImuSample& sample : samples) {
    if (sample.stamp > from) close(sample);
    previous = sample;
    if (sample.stamp >= to) return silent.seconds();
  }
  close({.stamp = to});
  return silent.seconds();
}

void AddGapUncertainty(StateEstimate& prediction, double silent, const GapConfig& config) {
  const double turn = config.rate_sigma * silent;
  const double speed = config.acceleration_sigma * silent;
  const double way = 0.5 * speed * silent;
  auto diagonal = prediction.covariance.diagonal();
  diagonal.segment<3>(nav_index::kPosition).array() += way * way;
  diagonal.segment<3>(nav_index::kVelocity).array() += speed * speed;
  diagonal.segment<3>(nav_index::kRotation).array() += turn * turn;
}

std::vector<NavState> Bent(std::vector<NavState> trajectory, const Pose3& T_world_end) {
  const Pose3 correction = trajectory.back().T_world_body.inverse() * T_world_end;
  const Time begin = trajectory.front().stamp;
  const double length = (trajectory.back().stamp - begin).seconds();
  for (NavState& state : trajectory) {
    const double share = length > 0.0 ? (state.stamp - begin).seconds() / length : 1.0;
    state.T_world_body = state.T_world_body * Interpolate(Pose3(), correction, share);
  }
  return trajectory;
}

}  // namespace mlvi

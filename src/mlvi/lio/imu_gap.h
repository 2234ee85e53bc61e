// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Sweeps during which the IMU was silent: the motion is then known by the registration alone.
#pragma once

#include <span>
#include <vector>

#include "mlvi/lio/filter_state.h"
#include "mlvi/lio/lio_config.h"

namespace mlvi {

// Seconds of [from, to] that lie in a pause of the samples of more than five periods (25 ms at
// least), or beyond their ends. `samples` in ascending order.
double SilentTime(std::span<const ImuSample> samples, Time from, Time to, double rate_hz);

// What the body may have done while nobody watched, by the rates and accelerations of `config`.
void AddGapUncertainty(StateEstimate& prediction, double silent, const GapConfig& config);

// The trajectory bent to end at `T_world_end`, each state by its share of the time.
std::vector<NavState> Bent(std::vector<NavState> trajectory, const Pose3& T_world_end);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "mlvi/sim/recording.h"
#include "simulate_options.h"

namespace mlvi {

// sequence.json (docs/outputs.md): what was simulated and with what, so that it can be repeated and
// an estimate be held against it. `bag_bytes` is the size of the finished bag.
nlohmann::ordered_json DescribeSequence(const Recording& recording, const SimulateOptions& options,
                                        bool interrupted, std::uintmax_t bag_bytes);

}  // namespace mlvi

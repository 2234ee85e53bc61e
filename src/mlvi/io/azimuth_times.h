// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Firing times of a spinning LiDAR whose message has none, from where the points lie. This assumes
// one turn per sweep at constant speed; it is right to about the azimuth spread of the beams of one
// column (a few milliseconds).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

struct AzimuthTimes {
  std::vector<std::int32_t> offsets;  // ns, >= 0, smallest 0
  bool clockwise = false;             // seen from above (from +z)
};

// For points in the order of firing: the azimuth of successive points must go round once, in either
// direction. Empty when it does not (points ordered by ring, sorted otherwise, or less than a half
// turn).
std::optional<AzimuthTimes> TimesFromAzimuth(const std::vector<LidarPoint>& points,
                                             Duration period);

// For organised clouds: the column of a point is its time, whatever the azimuth.
std::vector<std::int32_t> TimesFromColumns(const std::vector<std::uint32_t>& columns,
                                           std::uint32_t column_count, Duration period);

}  // namespace mlvi

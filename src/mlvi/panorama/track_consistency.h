// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "mlvi/geometry/triangulation.h"

namespace mlvi {

// By how much rays (at least two, one frame) miss the fixed point that suits them best, in sigmas
// of the worst one. The point may be at infinity, and is where rays meet behind their origins. What
// moves, and a crossing of edges whose way is not a straight one, has no such point; in one step
// it may well have.
double LargestMiss(std::span<const Ray> rays);

}  // namespace mlvi

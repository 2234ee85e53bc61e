// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sim/surface_relief.h"

namespace mlvi {

// The mean of a relief over what a beam lights: a Gaussian of `deviation` m across the beam, which
// meets the surface under the angle of incidence with that `cosine` (below 0.2 as if it were that).
// Small bumps go first.
Relief AveragedRelief(const Relief& relief, double deviation, double cosine);

}  // namespace mlvi

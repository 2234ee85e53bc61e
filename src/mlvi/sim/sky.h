// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "mlvi/sim/lighting.h"

namespace mlvi {

// Luminance of the sky, cd/m^2, in the unit `direction`: brighter towards the horizon, with soft
// clouds and a glow around the sun, but without the sun's disc. Gives `sky_illuminance` on level
// ground within a few percent. Below the horizon: hazy ground.
double SkyLuminance(const Lighting& lighting, const Eigen::Vector3d& direction);

// The same with the sun's disc, as a camera sees it.
double SkyAndSunLuminance(const Lighting& lighting, const Eigen::Vector3d& direction);

}  // namespace mlvi

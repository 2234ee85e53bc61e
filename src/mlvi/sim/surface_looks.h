// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/sim/world.h"

namespace mlvi {

// A material with the usual look of what it is called ("brick", "floorboards", "dark glass", ...):
// texture, its size, gloss. Unknown names are plain and grey. `reflectivity`: of the LiDAR's
// wavelength.
Material UsualMaterial(const std::string& name, double reflectivity);

}  // namespace mlvi

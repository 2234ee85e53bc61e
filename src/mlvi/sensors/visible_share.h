// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sensors/rig.h"

namespace mlvi {

// The share of a camera's pixels that its mask and its valid radius leave, in [0, 1]. The camera
// must have a lens model; its mask, if any, the size of its images.
double VisibleShare(const CameraSpec& camera);

}  // namespace mlvi

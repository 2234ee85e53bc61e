// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sensors/measurements.h"

// Points of a LiDAR drawn over images.

struct Colour {
  std::uint8_t blue, green, red;
};

// From red (1 m) over green to blue (40 m), even on a logarithmic scale. `range` > 0, m.
Colour ColourOfRange(double range);

// The image with three channels.
mlvi::Image Coloured(const mlvi::Image& image);

// Sets one pixel of an image of three channels.
void Paint(mlvi::Image& image, int column, int row, Colour colour);

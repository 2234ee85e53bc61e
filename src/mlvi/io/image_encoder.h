// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// A JPEG of a grey or colour image. `quality` in [1, 100].
Expected<std::vector<std::uint8_t>> EncodeJpeg(const Image& image, int quality);

// Writes a PNG or JPEG, by the ending of `path`. Errors: a file that cannot be written
// (CannotWrite).
Expected<void> WriteImage(const Image& image, const std::string& path);

}  // namespace mlvi

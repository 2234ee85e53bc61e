// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/base/error.h"
#include "mlvi/io/ros_messages.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi {

// To 8-bit grey. Raw images: mono8, 8UC1, bgr8, 8UC3, rgb8, bgra8, rgba8 and the four 8-bit Bayer
// patterns. Compressed ones: what OpenCV decodes (JPEG, PNG); a mosaic ("bayer_rggb8; png
// compressed") is interpolated. The camera index is left at 0. Errors (kInput) name encoding and
// sizes.
Expected<Image> DecodeImage(const ImageView& view);
Expected<Image> DecodeCompressedImage(const ImageView& view);

}  // namespace mlvi

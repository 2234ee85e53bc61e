// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "mlvi/base/error.h"
#include "mlvi/io/ros_messages.h"

namespace mlvi {

// "livox_ros_driver/CustomMsg" and the same message of other packages (livox_ros_driver2, forks).
bool IsLivoxType(std::string_view type);

// A Livox CustomMsg seen as a point cloud: the array of points is a block of fixed-size structs,
// whose fields are taken from the message definition that the bag carries (forks have added some).
// Errors (kInput): the definition has no array of structs with x, y, z; the message is cut short.
Expected<PointCloud2View> ViewLivoxPoints(ByteSpan message, std::string_view definition);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace mlvi {

// What is known of the LiDAR's clock: t_imu = t_lidar + seconds, beyond the offset in the rig.
struct TimeOffset {
  double seconds = 0.0;
  double sigma = 0.0;  // s
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/vio_config.h"

namespace mlvi {

void VioConfig::Declare(ConfigDeclaration& d) {
  d.Field("radius", radius, "m", "Of the panoramic sphere; matters to `none` and `plane` only",
          {0.1, 1000.0});
  d.Field("imu_memory", imu_memory, "s", "IMU samples, frames and tracks that are kept for a start",
          {1.0, 60.0});
  d.Section("tracker", tracker);
  d.Section("window", window);
  d.Section("keyframe", keyframe);
  d.Section("rest", rest);
  d.Section("depth", depth);
  d.Section("failure", failure);
  d.Section("start", start);
  d.AtMost("start.max_seconds", "imu_memory", "a start lacks what it is made from");
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibrated_rig.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi {

Rig CalibratedRig(Rig rig, std::span<const std::string> names, const VioCalibration& calibration) {
  MLVI_CHECK(names.size() == calibration.T_pano_camera.size(), "{} names of {} mounts",
             names.size(), calibration.T_pano_camera.size());
  for (CameraSpec& camera : rig.cameras) {
    const auto found = std::find(names.begin(), names.end(), camera.name);
    if (found == names.end()) continue;
    const auto i = static_cast<std::size_t>(found - names.begin());
    camera.T_body_camera = calibration.T_body_pano * calibration.T_pano_camera[i];
    camera.time_offset = camera.time_offset + Duration::FromSeconds(calibration.time_offsets[i]);
  }
  return rig;
}

}  // namespace mlvi

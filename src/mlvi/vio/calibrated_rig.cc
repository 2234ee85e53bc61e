// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibrated_rig.h"

#include "mlvi/base/error.h"

namespace mlvi {

Rig CalibratedRig(Rig rig, const VioCalibration& calibration) {
  MLVI_CHECK(rig.cameras.size() == calibration.T_pano_camera.size(), "{} cameras and {} mounts",
             rig.cameras.size(), calibration.T_pano_camera.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    CameraSpec& camera = rig.cameras[i];
    camera.T_body_camera = calibration.T_body_pano * calibration.T_pano_camera[i];
    camera.time_offset = camera.time_offset + Duration::FromSeconds(calibration.time_offsets[i]);
  }
  return rig;
}

}  // namespace mlvi

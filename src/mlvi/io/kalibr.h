// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/sensors/rig.h"

namespace mlvi {

// Takes cameras from a Kalibr camchain (cam0, cam1, ...): models, T_cam_imu (the inverse of our
// T_body_camera) or, for later cameras, T_cn_cnm1 (from the camera before), timeshift_cam_imu (our
// time_offset: t_imu = t_cam + shift) and topics. Replaces cameras of the rig that have the same
// name, keeps their rate, mask and radius; adds new ones. Returns the names of all in the chain.
// Models: pinhole + equidistant, pinhole + radtan, omni + radtan, ds + none. Errors
// (kConfiguration) name file, line and field, a chain without T_cam_imu among them (run the
// camera-IMU calibration first).
Expected<std::vector<std::string>> ImportKalibrCamchain(const std::string& path, Rig& rig);
Expected<std::vector<std::string>> ImportKalibrCamchainText(const std::string& yaml,
                                                            const std::string& origin, Rig& rig);

// Takes noise densities, random walks, rate and topic from a Kalibr imu.yaml.
Expected<void> ImportKalibrImu(const std::string& path, Rig& rig);
Expected<void> ImportKalibrImuText(const std::string& yaml, const std::string& origin, Rig& rig);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rigs for the tests of this module, which cannot read rig files: the LiDARs and mounts of
// RIGS 4.5.
#pragma once

#include <cmath>

#include "mlvi/sensors/rig.h"

namespace mlvi::test {

inline Rig MakeRig(const std::string& name, const std::string& model, int rings, double imu_rate,
                   const Pose3& T_body_lidar) {
  Rig rig;
  rig.name = name;
  rig.imu.topic = "/imu";
  rig.imu.rate_hz = imu_rate;
  rig.lidar.emplace();
  rig.lidar->topic = "/points";
  rig.lidar->model = model;
  rig.lidar->rings = rings;
  rig.lidar->T_body_lidar = T_body_lidar;
  return rig;
}

inline Rig NewerCollege() {
  return MakeRig("newer_college", "OS0-128", 128, 200.0,
                 Pose3(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), {-0.037, -0.008, -0.026}));
}

inline Rig M2dgr() {
  return MakeRig("m2dgr", "VLP-32C", 32, 150.0,
                 Pose3::FromTranslation({0.27255, -0.00053, 0.17954}));
}

inline Rig Hilti() {
  return MakeRig("hilti_2022", "PandarXT-32", 32, 400.0,
                 Pose3(Eigen::Quaterniond(0.0, std::sqrt(0.5), -std::sqrt(0.5), 0.0),
                       {-0.001, -0.00855, 0.055}));
}

}  // namespace mlvi::test

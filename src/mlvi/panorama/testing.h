// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rigs and random scenes for the tests of this module, of those above it, and of benchmarks.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/panorama/panorama_model.h"
#include "mlvi/sensors/camera_test_calibrations.h"

namespace mlvi::test {

inline Eigen::Vector3d RandomDirection(RandomStream& random) {
  return Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
}

inline Pose3 RandomPose(RandomStream& random, double translation, double angle) {
  return Pose3(ExpSo3(angle * RandomDirection(random)), translation * RandomDirection(random));
}

inline std::shared_ptr<const CameraModel> MakeCamera(const testing::TestCalibration& c) {
  auto model = MakeCameraModel(c.model, c.width, c.height, c.intrinsics, c.distortion);
  MLVI_CHECK(model.has_value(), "{}: {}", c.label, model.error().message);
  return *model;
}

// A fisheye that sees `field_of_view` rad from edge to edge of a square image.
inline std::shared_ptr<const CameraModel> MakeWideCamera(double field_of_view, int size = 800) {
  const double focal = (0.5 * size - 1.0) / (0.5 * field_of_view), middle = 0.5 * (size - 1);
  return MakeCamera(
      {"wide", "equidistant", size, size, {focal, focal, middle, middle}, {0, 0, 0, 0}});
}

// `count` cameras on a horizontal circle of radius `offset` m, all looking outwards; body =
// circle's centre, z up.
inline Rig RingRig(int count, double offset, const std::shared_ptr<const CameraModel>& model) {
  Rig rig;
  rig.name = "ring";
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2.0 * M_PI * i / count;
    const Eigen::Vector3d z(std::cos(azimuth), std::sin(azimuth), 0.0);
    Eigen::Matrix3d R;
    R << z.cross(Eigen::Vector3d::UnitZ()), -Eigen::Vector3d::UnitZ(), z;
    CameraSpec camera;
    camera.name = "cam" + std::to_string(i);
    camera.model = model;
    camera.T_body_camera = Pose3(Eigen::Quaterniond(R), offset * z);
    rig.cameras.push_back(camera);
  }
  rig.p_body_pano = Eigen::Vector3d::Zero();
  return rig;
}

inline PanoramaModel MakePanorama(const Rig& rig, const PanoramaOptions& options = {}) {
  auto model = PanoramaModel::FromRig(rig, options);
  MLVI_CHECK(model.has_value(), "{}", model.error().message);
  return *model;
}

}  // namespace mlvi::test

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rigs and random scenes for the tests of this module, of those above it, and of benchmarks.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/panorama/compensation.h"
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

// Random geometry of one camera at `views` places: directions of the point, of the camera's offset
// and of the motions are uniform on the sphere, and so are the axes of rotation.
struct ViewSetting {
  double offset = 0.08;    // m, of the camera from S
  double depth = 10.0;     // m, of the point from the first S
  double radius = 1.0;     // m
  double baseline = 0.5;   // m, from the first S to the others
  double rotation = 0.17;  // rad, from the first view to the others
  double noise = 0.0;      // rad, of bearings
  int views = 2;
};

struct RandomViews {
  Eigen::Vector3d point;  // world; the first pano frame is the world
  std::vector<PanoramicView> views;
};

inline PanoramicView MakeView(const ViewSetting& s, const Eigen::Vector3d& point,
                              const Eigen::Vector3d& center, const Pose3& T_world_pano,
                              RandomStream& random) {
  PanoramicView view{.T_world_pano = T_world_pano, .pixel_sigma = std::max(s.noise, 1e-6)};
  PanoramicObservation& o = view.observation;
  o.center = center;
  const Eigen::Vector3d exact = (T_world_pano.inverse() * point - center).normalized();
  const Eigen::Vector2d noise(random.Normal(), random.Normal());
  o.bearing = (exact + TangentBasis(exact) * (s.noise * noise)).normalized();
  o.point = PointOnSphere(o.center, o.bearing, s.radius);
  o.pixel_per_bearing = TangentBasis(o.bearing).transpose();  // a lens of 1 px/rad
  return view;
}

inline RandomViews MakeRandomViews(const ViewSetting& s, RandomStream& random) {
  RandomViews result{.point = s.depth * RandomDirection(random), .views = {}};
  const Eigen::Vector3d center = s.offset * RandomDirection(random);
  for (int i = 0; i < s.views; ++i) {
    const Pose3 motion = i == 0 ? Pose3() : RandomPose(random, s.baseline, s.rotation);
    result.views.push_back(MakeView(s, result.point, center, motion, random));
  }
  return result;
}

// |depth / truth - 1| of the point seen from the first place; what cannot be triangulated counts as
// an error of its own size.
inline double DepthError(const ViewSetting& s, Compensation mode, RandomStream random) {
  const RandomViews scene = MakeRandomViews(s, random);
  std::optional<Eigen::Vector3d> estimate;
  if (s.views == 2) {
    estimate = TriangulateTwoViews(scene.views[0], scene.views[1], mode);
  } else if (const auto result = TriangulateViews(scene.views, mode)) {
    estimate = result->point;
  }
  return estimate ? std::abs(estimate->norm() / s.depth - 1.0) : 1.0;
}

inline double MedianDepthError(const ViewSetting& setting, Compensation mode, int trials) {
  std::vector<double> errors;
  const RandomStream random(1, "compensation");
  for (int i = 0; i < trials; ++i) {
    errors.push_back(DepthError(setting, mode, random.Fork(static_cast<std::uint64_t>(i))));
  }
  const auto middle = errors.begin() + trials / 2;
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

}  // namespace mlvi::test

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/bearing_residual.h"

#include <gtest/gtest.h>

#include "mlvi/geometry/numeric_jacobian.h"
#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

constexpr double kRadius = 1.5;

// A point seen by a camera at one instant and by the same or another camera at another.
struct Scene {
  PanoramaModel model =
      test::MakePanorama(test::RingRig(3, 0.25, test::MakeWideCamera(3.6)), {.radius = kRadius});
  BearingGeometry geometry;
  PanoramicObservation anchor, target;
  double depth = 0.0;  // along the anchor's camera ray
};

Scene RandomScene(RandomStream& random, bool cross_camera) {
  while (true) {
    Scene s;
    s.geometry.T_world_anchor = test::RandomPose(random, 3.0, 2.0);
    s.geometry.T_world_target = s.geometry.T_world_anchor * test::RandomPose(random, 0.4, 0.3);
    s.geometry.T_body_pano = test::RandomPose(random, 0.2, 0.4);
    const Eigen::Vector3d p_pano = random.Uniform(1.0, 15.0) * test::RandomDirection(random);
    const auto anchor_views = s.model.ViewsOfPoint(p_pano);
    if (anchor_views.empty()) continue;
    const Pose3 T_target_anchor = s.geometry.T_body_pano.inverse() *
                                  s.geometry.T_world_target.inverse() * s.geometry.T_world_anchor *
                                  s.geometry.T_body_pano;
    const auto target_views = s.model.ViewsOfPoint(T_target_anchor * p_pano);
    for (const CameraView& view : target_views) {
      if ((view.camera != anchor_views[0].camera) != cross_camera) continue;
      s.anchor = *s.model.Lift(anchor_views[0].camera, anchor_views[0].pixel);
      s.target = *s.model.Lift(view.camera, view.pixel);
      s.depth = (p_pano - s.anchor.center).norm();
      return s;
    }
  }
}

// All that a residual depends on, moved by one vector of tangents: five poses and the inverse
// depth.
Eigen::Vector2d ResidualAt(const Scene& s, Compensation mode, double inverse_depth,
                           const Eigen::Matrix<double, 31, 1>& delta) {
  const auto part = [&](int i) { return Vector6d(delta.segment<6>(6 * i)); };
  const BearingGeometry moved{BoxPlus(s.geometry.T_world_anchor, part(0)),
                              BoxPlus(s.geometry.T_world_target, part(1)),
                              BoxPlus(s.geometry.T_body_pano, part(2))};
  const auto ray = [&](const PanoramicObservation& o, int i, RayRole role) {
    return MakePanoramicRay(o, BoxPlus(s.model.T_pano_camera(o.camera), part(i)), kRadius, mode,
                            role);
  };
  const auto residual =
      BearingResidual(ray(s.anchor, 3, RayRole::kAnchor), inverse_depth + delta[30],
                      ray(s.target, 4, RayRole::kTarget), moved);
  return residual.value();
}

class EveryMode : public ::testing::TestWithParam<Compensation> {};

TEST_P(EveryMode, JacobiansAgreeWithDifferences) {
  RandomStream random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const Scene s = RandomScene(random, trial % 2 == 1);
    // At the truth, off it, and at infinity.
    const double inverse_depth = trial % 5 == 0 ? 0.0 : random.Uniform(0.8, 1.2) / s.depth;
    BearingJacobians j;
    const auto residual =
        BearingResidual(MakePanoramicRay(s.anchor, s.model.T_pano_camera(s.anchor.camera), kRadius,
                                         GetParam(), RayRole::kAnchor),
                        inverse_depth,
                        MakePanoramicRay(s.target, s.model.T_pano_camera(s.target.camera), kRadius,
                                         GetParam(), RayRole::kTarget),
                        s.geometry, &j);
    ASSERT_TRUE(residual.has_value());
    Eigen::Matrix<double, 2, 31> analytic;
    analytic << j.anchor, j.target, j.body_pano, j.anchor_camera, j.target_camera, j.inverse_depth;
    using Delta = Eigen::Matrix<double, 31, 1>;
    const Eigen::MatrixXd numeric =
        NumericJacobian([&](const Delta& d) { return ResidualAt(s, GetParam(), inverse_depth, d); },
                        Delta(Delta::Zero()), 1e-3);
    EXPECT_LT((analytic - numeric).norm(), 1e-6 * (1.0 + numeric.norm()));
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, EveryMode,
                         ::testing::Values(Compensation::kNone, Compensation::kPlane,
                                           Compensation::kRay));

Eigen::Vector2d ResidualAtTruth(const Scene& s, Compensation mode) {
  return ResidualAt(s, mode, 1.0 / s.depth, Eigen::Matrix<double, 31, 1>::Zero());
}

TEST(BearingResidual, OfExactRaysAndOfPlanesVanishesAtTheTruth) {
  RandomStream random(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Scene s = RandomScene(random, trial % 2 == 1);
    EXPECT_LT(ResidualAtTruth(s, Compensation::kRay).norm(), 1e-6);
    EXPECT_LT(ResidualAtTruth(s, Compensation::kPlane).norm(), 1e-6);
  }
}

// Eq. (8): the planes mode sees what leaves plane (S, C, u) as exact rays do, and nothing else.
TEST(BearingResidual, OfPlanesIsThatOfRaysNormalToThePlane) {
  RandomStream random(3);
  int checked = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Scene s = RandomScene(random, trial % 2 == 1);
    const Eigen::Vector3d normal = s.target.center.cross(s.target.bearing);
    if (normal.norm() < 0.02) continue;
    ++checked;
    Eigen::Matrix<double, 31, 1> off;
    for (int i = 0; i < 31; ++i) off[i] = 1e-3 * random.Normal();
    const double inverse_depth = 1.0 / s.depth;
    const Eigen::Vector2d ray = ResidualAt(s, Compensation::kRay, inverse_depth, off);
    const Eigen::Vector2d plane = ResidualAt(s, Compensation::kPlane, inverse_depth, off);
    const Eigen::Vector3d n = normal.normalized();
    // px per rad along the normal and, in the plane, across the bearing.
    Eigen::Matrix2d basis;
    basis << s.target.pixel_per_bearing * n, s.target.pixel_per_bearing * n.cross(s.target.bearing);
    const Eigen::Vector2d by_ray = basis.inverse() * ray, by_plane = basis.inverse() * plane;
    EXPECT_NEAR(by_plane[0], by_ray[0], 1e-4 * by_ray.norm());
    EXPECT_NEAR(by_plane[1], 0.0, 1e-12);
  }
  EXPECT_GT(checked, 100);
}

// All modes agree where cameras have no offset, and at depth r.
TEST(BearingResidual, ModesAgreeWithoutOffset) {
  RandomStream random(4);
  for (int trial = 0; trial < 100; ++trial) {
    Scene s = RandomScene(random, false);
    for (int camera = 0; camera < 3; ++camera) {
      s.model.set_T_pano_camera(
          camera, Pose3(s.model.T_pano_camera(camera).rotation(), Eigen::Vector3d::Zero()));
    }
    s.anchor = *s.model.Lift(s.anchor.camera, s.anchor.pixel);
    s.target = *s.model.Lift(s.target.camera, s.target.pixel);
    const Eigen::Vector2d ray = ResidualAtTruth(s, Compensation::kRay);
    EXPECT_LT((ResidualAtTruth(s, Compensation::kNone) - ray).norm(), 1e-6);
    EXPECT_LT((ResidualAtTruth(s, Compensation::kPlane) - ray).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace mlvi

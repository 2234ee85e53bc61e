// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/panorama/panorama_model.h"

#include <gtest/gtest.h>

#include "mlvi/panorama/testing.h"

namespace mlvi {
namespace {

Eigen::Vector2d RandomPixel(const CameraModel& camera, RandomStream& random) {
  return {random.Uniform(0.0, camera.width() - 1.0), random.Uniform(0.0, camera.height() - 1.0)};
}

class EveryLens : public ::testing::TestWithParam<testing::TestCalibration> {
 protected:
  // Three cameras of this lens, 0.3 m from S, one of them with a valid radius.
  PanoramaModel model_ = [] {
    Rig rig = test::RingRig(3, 0.3, test::MakeCamera(GetParam()));
    rig.cameras[1].valid_radius_px = 250.0;
    return test::MakePanorama(rig, {.radius = 5.0, .border_px = 0.0});
  }();
};

// To the very edge of what the lens model holds: corners of the image, the valid radius, the limit
// of the domain.
TEST_P(EveryLens, LiftedPixelsLieOnTheSphereAndProjectBack) {
  RandomStream random(1);
  int lifted = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const int camera = trial % 3;
    Eigen::Vector2d pixel = RandomPixel(model_.camera(camera), random);
    if (trial < 12)
      pixel = Eigen::Vector2d((trial / 3) % 2, trial / 6)
                  .cwiseProduct(Eigen::Vector2d(model_.camera(camera).width() - 1,
                                                model_.camera(camera).height() - 1));
    const auto o = model_.Lift(camera, pixel);
    ASSERT_EQ(o.has_value(),
              model_.Usable(camera, pixel) && model_.camera(camera).Unproject(pixel).has_value());
    if (!o) continue;
    ++lifted;
    EXPECT_EQ(o->camera, camera);
    EXPECT_NEAR(o->point.norm(), 5.0, 1e-12);
    EXPECT_NEAR(o->bearing.norm(), 1.0, 1e-12);
    // Eq. (2) with lambda > 0: C, u_s and the bearing are on one ray.
    EXPECT_LT((o->point - o->center).cross(o->bearing).norm(), 1e-12);
    EXPECT_GT((o->point - o->center).dot(o->bearing), 0.0);
    const auto near = model_.ProjectPoint(camera, o->center + 3.0 * o->bearing);
    const auto on_sphere = model_.ProjectPoint(camera, o->point);
    const auto far = model_.ProjectDirection(camera, o->bearing);
    // At the last digits of an edge the way back may end outside.
    if (!near || !on_sphere || !far) {
      EXPECT_FALSE(model_.Usable(camera, pixel + Eigen::Vector2d(1e-6, 1e-6)) &&
                   model_.Usable(camera, pixel - Eigen::Vector2d(1e-6, 1e-6)));
      continue;
    }
    EXPECT_LT((*near - pixel).norm() + (*on_sphere - pixel).norm() + (*far - pixel).norm(), 1e-5);
  }
  EXPECT_GT(lifted, 500);
}

TEST_P(EveryLens, ResolutionIsTheDerivativeOfTheProjection) {
  RandomStream random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const auto o = model_.Lift(0, RandomPixel(model_.camera(0), random));
    if (!o) continue;
    EXPECT_LT((o->pixel_per_bearing * o->bearing).norm(), 1e-6 * o->pixel_per_bearing.norm());
    const Eigen::Vector3d moved = o->bearing + 1e-6 * test::RandomDirection(random);
    const auto pixel = model_.ProjectDirection(0, moved);
    if (!pixel) continue;
    const Eigen::Vector2d expected = o->pixel_per_bearing * (moved - o->bearing);
    EXPECT_LT((*pixel - o->pixel - expected).norm(), 1e-5);
  }
}

TEST_P(EveryLens, EveryCameraThatSeesADirectionIsListedNearestAxisFirst) {
  RandomStream random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d direction = test::RandomDirection(random);
    const auto views = model_.ViewsOfDirection(direction);
    int seen = 0;
    for (int camera = 0; camera < 3; ++camera) {
      seen += model_.ProjectDirection(camera, direction).has_value() ? 1 : 0;
    }
    ASSERT_EQ(static_cast<int>(views.size()), seen);
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Eigen::Vector3d axis = model_.T_pano_camera(views[i].camera).R().col(2);
      EXPECT_NEAR(views[i].off_axis, std::acos(axis.dot(direction)), 1e-6);
      if (i > 0) {
        EXPECT_LE(views[i - 1].off_axis, views[i].off_axis);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Calibrations, EveryLens, ::testing::ValuesIn(testing::AllCalibrations()),
                         [](const auto& parameter) { return parameter.param.label; });

TEST(PanoramaModel, CenterIsTheMeanOfTheCamerasUnlessTheRigSaysOtherwise) {
  Rig rig = test::RingRig(4, 0.1, test::MakeWideCamera(2.0));
  rig.p_body_pano.reset();
  rig.cameras[0].T_body_camera = Pose3::FromTranslation({0.4, 0.0, 0.2});
  const PanoramaModel model = test::MakePanorama(rig);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4; ++i) mean += model.T_pano_camera(i).translation() / 4.0;
  EXPECT_LT(mean.norm(), 1e-12);
  rig.p_body_pano = Eigen::Vector3d(0.0, 0.1, 0.0);
  EXPECT_EQ(test::MakePanorama(rig).T_body_pano().translation(), *rig.p_body_pano);
}

// Beyond 180 degrees: a fisheye of 220 degrees sees directions behind its image plane.
TEST(PanoramaModel, FieldsOfViewBeyond180DegreesAreOrdinary) {
  const PanoramaModel model =
      test::MakePanorama(test::RingRig(1, 0.05, test::MakeWideCamera(3.84)));
  const Eigen::Vector3d behind = Eigen::Vector3d(-0.2, 1.0, 0.0).normalized();  // axis is +x
  const auto pixel = model.ProjectDirection(0, behind);
  ASSERT_TRUE(pixel.has_value());
  const auto lifted = model.Lift(0, *pixel);
  ASSERT_TRUE(lifted.has_value());
  EXPECT_LT((lifted->bearing - behind).norm(), 1e-9);
}

TEST(PanoramaModel, MasksKeepPixelsOut) {
  Rig rig = test::RingRig(2, 0.05, test::MakeWideCamera(2.0, 100));
  Image mask{.width = 100, .height = 100, .pixels = std::vector<std::uint8_t>(10000, 255)};
  std::fill_n(mask.pixels.begin(), 5000, 0);  // the upper half
  rig.cameras[0].mask = std::make_shared<const Image>(mask);
  const PanoramaModel model = test::MakePanorama(rig);
  EXPECT_FALSE(model.Lift(0, {50.0, 49.4}).has_value());
  EXPECT_TRUE(model.Lift(0, {50.0, 49.6}).has_value());
  EXPECT_TRUE(model.Lift(1, {50.0, 49.4}).has_value());
}

TEST(PanoramaModel, ErrorsNameWhatIsWrong) {
  Rig rig = test::RingRig(2, 0.3, test::MakeWideCamera(2.0, 100));
  const auto inside = PanoramaModel::FromRig(rig, {.radius = 0.25});
  ASSERT_FALSE(inside.has_value());
  EXPECT_NE(inside.error().message.find("0.300 m from the centre"), std::string::npos);
  rig.cameras.clear();
  EXPECT_FALSE(PanoramaModel::FromRig(rig).has_value());
}

}  // namespace
}  // namespace mlvi

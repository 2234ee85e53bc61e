// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// One suite of laws for all camera models, over real calibrations, to the edge of their field of
// view.
#include "mlvi/sensors/camera_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <numbers>

#include "mlvi/base/random.h"
#include "mlvi/geometry/numeric_jacobian.h"
#include "mlvi/sensors/camera_test_calibrations.h"

namespace mlvi {
namespace {

using testing::TestCalibration;
constexpr double kDegree = std::numbers::pi / 180.0;

std::shared_ptr<const CameraModel> Make(const TestCalibration& c) {
  auto model = MakeCameraModel(c.model, c.width, c.height, c.intrinsics, c.distortion);
  MLVI_CHECK(model.has_value(), "{}: {}", c.label, model.error().message);
  return *model;
}

// The same model with other parameters (fx fy cx cy shape).
std::shared_ptr<const CameraModel> WithParameters(const TestCalibration& c,
                                                  const Eigen::VectorXd& p) {
  const auto lead = static_cast<Eigen::Index>(c.intrinsics.size()) - 4;
  TestCalibration moved = c;
  moved.intrinsics.clear();
  moved.distortion.clear();
  for (Eigen::Index i = 0; i < lead; ++i) moved.intrinsics.push_back(p[4 + i]);
  for (Eigen::Index i = 0; i < 4; ++i) moved.intrinsics.push_back(p[i]);
  for (Eigen::Index i = 4 + lead; i < p.size(); ++i) moved.distortion.push_back(p[i]);
  return Make(moved);
}

Eigen::Vector3d Bearing(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

// Smallest singular value of d pixel / d bearing, px/rad: how well the lens tells angles apart
// there.
double Resolution(const CameraModel& camera, const Eigen::Vector3d& bearing) {
  CameraModel::PointJacobian J;
  if (!camera.Project(bearing, &J)) return 0.0;
  return J.jacobiSvd().singularValues()[1];
}

class CameraLaws : public ::testing::TestWithParam<TestCalibration> {
 protected:
  std::shared_ptr<const CameraModel> camera_ = Make(GetParam());
};

TEST_P(CameraLaws, EveryPixelWithABearingReturnsToItself) {
  std::size_t valid = 0, all = 0;
  for (int v = 0; v < camera_->height(); v += 3) {
    for (int u = 0; u < camera_->width(); u += 3, ++all) {
      const Eigen::Vector2d pixel(u, v);
      const auto bearing = camera_->Unproject(pixel);
      if (!bearing) continue;
      ++valid;
      ASSERT_NEAR(bearing->norm(), 1.0, 1e-14);
      const auto back = camera_->Project(*bearing);
      ASSERT_TRUE(back) << pixel.transpose();
      ASSERT_LT((*back - pixel).norm(), 1e-8) << pixel.transpose();
    }
  }
  EXPECT_GT(valid, all / 2);
}

TEST_P(CameraLaws, ThePrincipalPointLooksForward) {
  const auto bearing = camera_->Unproject(camera_->principal_point());
  ASSERT_TRUE(bearing);
  // Tangential distortion leaves the axis alone.
  EXPECT_LT((*bearing - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const auto pixel = camera_->Project(Eigen::Vector3d(0.0, 0.0, 5.0));
  ASSERT_TRUE(pixel);
  EXPECT_LT((*pixel - camera_->principal_point()).norm(), 1e-12);
}

TEST_P(CameraLaws, EveryBearingReturnsToItself) {
  RandomStream random(1, GetParam().label);
  int valid = 0;
  for (int i = 0; i < 5000; ++i) {
    const double theta = camera_->max_angle() * random.Uniform();
    const Eigen::Vector3d bearing = Bearing(theta, random.Uniform(0.0, 2.0 * std::numbers::pi));
    const auto pixel = camera_->Project(random.Uniform(0.1, 50.0) * bearing);
    const double resolution = Resolution(*camera_, bearing);
    if (!pixel || resolution < 1e-3)
      continue;  // tangential distortion narrows the domain; see InvalidDomain
    ++valid;
    const auto back = camera_->Unproject(*pixel);
    ASSERT_TRUE(back) << theta;
    // A pixel is exact to about 1e-12 of its value; the lens turns that into an angle.
    const double tolerance = 1e-12 * (10.0 + pixel->norm()) / resolution + 1e-14;
    ASSERT_LT((*back - bearing).norm(), tolerance)
        << "theta " << theta << " of " << camera_->max_angle();
  }
  EXPECT_GT(valid, 4500);
}

TEST_P(CameraLaws, ProjectionDoesNotDependOnDistance) {
  RandomStream random(2, GetParam().label);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d bearing =
        Bearing(0.95 * camera_->max_angle() * random.Uniform(), random.Uniform(0.0, 6.0));
    const auto near = camera_->Project(0.01 * bearing), far = camera_->Project(1e4 * bearing);
    ASSERT_EQ(near.has_value(), far.has_value());
    if (!near) continue;
    ASSERT_LT((*near - *far).norm(), 1e-9 * (1.0 + near->norm()));
  }
}

TEST_P(CameraLaws, PointJacobianIsTheDerivative) {
  RandomStream random(3, GetParam().label);
  int compared = 0;
  for (int i = 0; i < 500; ++i) {
    // The axis itself, its near surroundings, and the rest up to the edge of the field of view.
    const double spread = i % 3 == 0 ? 1e-6 : 0.97;
    const double theta = i == 0 ? 0.0 : spread * camera_->max_angle() * random.Uniform();
    const Eigen::Vector3d point =
        random.Uniform(0.5, 5.0) * Bearing(theta, random.Uniform(0.0, 6.28));
    CameraModel::PointJacobian analytic;
    const auto pixel = camera_->Project(point, &analytic);
    if (!pixel || pixel->norm() > 1e4) continue;
    // Second and higher derivatives grow with the magnification: keep the step small against the
    // distance to the limit.
    const double step = 1e-3 * point.norm() * std::min(1.0, camera_->max_angle() - theta);
    const Eigen::MatrixXd numeric = NumericJacobian(
        [&](const Eigen::Vector3d& p) { return Eigen::Vector2d(camera_->Project(p).value()); },
        point, step);
    ASSERT_LT((analytic - numeric).norm(), 1e-6 * (1.0 + numeric.norm())) << "theta " << theta;
    ++compared;
  }
  EXPECT_GT(compared, 300);
}

TEST_P(CameraLaws, ParameterJacobianIsTheDerivative) {
  RandomStream random(4, GetParam().label);
  const auto names = camera_->parameter_names();
  const Eigen::VectorXd parameters = camera_->parameters();
  ASSERT_EQ(static_cast<Eigen::Index>(names.size()), parameters.size());
  int compared = 0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d point =
        2.0 * Bearing(0.8 * std::min(camera_->max_angle(), 1.8) * random.Uniform(),
                      random.Uniform(0.0, 6.28));
    CameraModel::ParameterJacobian analytic;
    if (!camera_->Project(point, nullptr, &analytic)) continue;
    const Eigen::MatrixXd numeric = NumericJacobian(
        [&](const Eigen::VectorXd& p) {
          return Eigen::Vector2d(WithParameters(GetParam(), p)->Project(point).value());
        },
        parameters, 1e-4);
    ASSERT_LT((analytic - numeric).norm(), 1e-6 * (1.0 + numeric.norm())) << point.transpose();
    ++compared;
  }
  EXPECT_GT(compared, 80);
}

TEST_P(CameraLaws, PixelJacobianIsTheDerivativeAndTangent) {
  RandomStream random(5, GetParam().label);
  int compared = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector2d pixel(random.Uniform(0.0, camera_->width() - 1.0),
                                random.Uniform(0.0, camera_->height() - 1.0));
    CameraModel::PixelJacobian analytic;
    const auto bearing = camera_->Unproject(pixel, &analytic);
    // Where the lens turns over, derivatives have no bound and differences no meaning.
    if (!bearing || Resolution(*camera_, *bearing) < 0.2 * camera_->parameters()[0]) continue;
    ASSERT_LT((bearing->transpose() * analytic).norm(), 1e-12);
    const Eigen::MatrixXd numeric = NumericJacobian(
        [&](const Eigen::Vector2d& p) { return Eigen::Vector3d(camera_->Unproject(p).value()); },
        pixel, 0.05);
    ASSERT_LT((analytic - numeric).norm(), 1e-6 * numeric.norm()) << pixel.transpose();
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

TEST_P(CameraLaws, WhatLiesOutsideOfTheDomainIsRejected) {
  RandomStream random(6, GetParam().label);
  for (int i = 0; i < 1000; ++i) {
    const double theta = random.Uniform(camera_->max_angle() + 1e-9, std::numbers::pi);
    EXPECT_FALSE(camera_->Project(Bearing(theta, random.Uniform(0.0, 6.28)))) << theta;
  }
  EXPECT_FALSE(camera_->Project(Eigen::Vector3d::Zero()));
  EXPECT_FALSE(camera_->Project(Eigen::Vector3d(0.0, 0.0, -1.0)));
  const double nan = std::nan("");
  EXPECT_FALSE(camera_->Project(Eigen::Vector3d(nan, 0.0, 1.0)));
  EXPECT_FALSE(camera_->Project(Eigen::Vector3d(0.1, 0.1, nan)));
  EXPECT_FALSE(camera_->Unproject(Eigen::Vector2d(nan, 0.0)));
  EXPECT_FALSE(camera_->Unproject(Eigen::Vector2d(1e20, 1e20)));
}

// One-to-one: away from the axis the distance from the principal point grows with the angle, all
// the way to the limit.
TEST_P(CameraLaws, AnglesGrowOutwards) {
  for (double phi = 0.0; phi < 6.28; phi += 0.3) {
    double last = -1.0;
    for (int i = 0; i < 2000; ++i) {
      const auto pixel = camera_->Project(Bearing(camera_->max_angle() * i / 2000.0, phi));
      if (!pixel) break;
      const double radius = (*pixel - camera_->principal_point()).norm();
      ASSERT_GT(radius, last) << "step " << i << " phi " << phi;
      last = radius;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(RealCalibrations, CameraLaws,
                         ::testing::ValuesIn(testing::AllCalibrations()),
                         [](const auto& c) { return c.param.label; });

TEST(KannalaBrandt, LimitsOfRealCalibrations) {
  const auto find = [](const std::string& label) {
    for (const TestCalibration& c : testing::AllCalibrations()) {
      if (c.label == label) return Make(c);
    }
    throw std::out_of_range(label);
  };
  // RIGS.md 2.2 and 3.2, in degrees, rounded there to 0.1.
  EXPECT_NEAR(find("m2dgr_fifth_backleft")->max_angle() / kDegree, 76.9, 0.06);
  EXPECT_NEAR(find("m2dgr_head")->max_angle() / kDegree, 90.2, 0.06);
  const double hilti[] = {91.9, 96.5, 104.6, 108.9, 103.2};
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(find("hilti_cam" + std::to_string(i))->max_angle() / kDegree, hilti[i], 0.06) << i;
  }
  for (const TestCalibration& c : testing::NewerCollegeCalibrations())
    EXPECT_GT(Make(c)->max_angle(), 98.0 * kDegree);
  // 585.8 px by the mean focal length: the last pixel that has a bearing.
  const auto fifth = find("m2dgr_fifth_backleft");
  const double limit = 585.8 / 539.27;
  const double fx = fifth->parameters()[0];
  EXPECT_TRUE(
      fifth->Unproject(fifth->principal_point() + Eigen::Vector2d(fx * (limit - 2e-3), 0.0)));
  EXPECT_FALSE(
      fifth->Unproject(fifth->principal_point() + Eigen::Vector2d(fx * (limit + 2e-3), 0.0)));
}

TEST(KannalaBrandt, SeesBehindItself) {
  const auto camera =
      MakeCameraModel("equidistant", 1000, 1000, {200.0, 200.0, 500.0, 500.0}, {0, 0, 0, 0})
          .value();
  const auto pixel = camera->Project(Bearing(110.0 * kDegree, 0.5));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR((*pixel - camera->principal_point()).norm(), 200.0 * 110.0 * kDegree, 1e-9);
}

// With xi = 0 and no distortion the sphere model is the pinhole; with xi = alpha = 0 so is the
// double sphere.
TEST(CameraModel, SphereModelsContainThePinhole) {
  const auto pinhole =
      MakeCameraModel("pinhole_radtan", 640, 480, {400, 410, 320, 240}, {0, 0, 0, 0}).value();
  const auto mei =
      MakeCameraModel("mei", 640, 480, {0.0, 400, 410, 320, 240}, {0, 0, 0, 0}).value();
  const auto ds =
      MakeCameraModel("double_sphere", 640, 480, {0.0, 0.0, 400, 410, 320, 240}, {}).value();
  for (double theta = 0.0; theta < 1.2; theta += 0.1) {
    const Eigen::Vector2d expected = pinhole->Project(Bearing(theta, 1.0)).value();
    EXPECT_LT((mei->Project(Bearing(theta, 1.0)).value() - expected).norm(), 1e-10);
    EXPECT_LT((ds->Project(Bearing(theta, 1.0)).value() - expected).norm(), 1e-10);
  }
}

TEST(CameraModel, ErrorsNameWhatIsWrong) {
  const auto message = [](auto&&... args) { return MakeCameraModel(args...).error().message; };
  const std::vector<double> k = {400, 400, 320, 240}, d = {0, 0, 0, 0};
  EXPECT_THAT(message("equidistent", 640, 480, k, d),
              ::testing::HasSubstr("did you mean 'equidistant'?"));
  EXPECT_THAT(message("equidistant", 640, 480, std::vector<double>{400, 320, 240}, d),
              ::testing::HasSubstr("3 intrinsics given, expected 4 (fx, fy, cx, cy)"));
  EXPECT_THAT(message("mei", 640, 480, k, d), ::testing::HasSubstr("xi"));
  EXPECT_THAT(message("equidistant", 640, 480, k, std::vector<double>{0.1}),
              ::testing::HasSubstr("k1, k2, k3, k4"));
  EXPECT_THAT(message("equidistant", 0, 480, k, d), ::testing::HasSubstr("0 x 480"));
  EXPECT_THAT(message("equidistant", 640, 480, std::vector<double>{-1, 400, 320, 240}, d),
              ::testing::HasSubstr("fx = -1"));
  EXPECT_THAT(message("equidistant", 640, 480, k, std::vector<double>{0, 0, std::nan(""), 0}),
              ::testing::HasSubstr("not finite"));
  EXPECT_THAT(message("double_sphere", 640, 480, std::vector<double>{0.1, 1.5, 400, 400, 320, 240},
                      std::vector<double>{}),
              ::testing::HasSubstr("alpha = 1.5"));
  EXPECT_THAT(message("mei", 640, 480, std::vector<double>{-0.1, 400, 400, 320, 240}, d),
              ::testing::HasSubstr("xi = -0.1"));
  EXPECT_EQ(CameraModelNames().size(), 4U);
}

TEST(CameraModel, InImageCountsPixelCentres) {
  const auto camera =
      MakeCameraModel("equidistant", 640, 480, {400, 400, 320, 240}, {0, 0, 0, 0}).value();
  EXPECT_TRUE(camera->InImage({0.0, 0.0}));
  EXPECT_TRUE(camera->InImage({639.0, 479.0}));
  EXPECT_FALSE(camera->InImage({639.1, 479.0}));
  EXPECT_FALSE(camera->InImage({-0.1, 10.0}));
  EXPECT_FALSE(camera->InImage({4.0, 100.0}, 5.0));
  EXPECT_THAT(camera->parameter_names(),
              ::testing::ElementsAre("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"));
}

}  // namespace
}  // namespace mlvi

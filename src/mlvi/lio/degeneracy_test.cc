// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/degeneracy.h"

#include <gtest/gtest.h>

#include "mlvi/base/random.h"

namespace mlvi {
namespace {

// Information of random points on planes with the given normals; sigma 1 cm; identity attitude.
Matrix6d InformationOf(const std::vector<Eigen::Vector3d>& normals, int points_per_normal) {
  RandomStream random(1);
  Matrix6d A = Matrix6d::Zero();
  for (const Eigen::Vector3d& normal : normals) {
    for (int i = 0; i < points_per_normal; ++i) {
      const Eigen::Vector3d p(random.Uniform(-5, 5), random.Uniform(-5, 5), random.Uniform(-2, 2));
      Vector6d h;
      h << normal, p.cross(normal);
      A += h * h.transpose() / 1e-4;
    }
  }
  return A;
}

const Eigen::Vector3d kX(1, 0, 0), kY(0, 1, 0), kZ(0, 0, 1);

TEST(FindDegeneracy, NoneInARoom) {
  const auto found = FindDegeneracy(InformationOf({kX, kY, kZ}, 200), Matrix6d::Zero(),
                                    Eigen::Quaterniond::Identity(), {}, {});
  EXPECT_FALSE(found.report.any());
  EXPECT_TRUE(found.motions.empty());
}

TEST(FindDegeneracy, AxesAreInTheWorldFrame) {
  // A floor: two translations and the rotation about its normal. The body is turned: body y is
  // world z.
  const Eigen::Quaterniond R_world_body(Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitX()));
  RandomStream random(2);
  Matrix6d A = Matrix6d::Zero();
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p_world(random.Uniform(-5, 5), random.Uniform(-5, 5), -1.0);
    const Eigen::Vector3d p_body = R_world_body.conjugate() * p_world;
    Vector6d h;
    h << kZ, p_body.cross(R_world_body.conjugate() * kZ);
    A += h * h.transpose() / 1e-4;
  }
  const auto found = FindDegeneracy(A, Matrix6d::Zero(), R_world_body, {}, {});
  EXPECT_EQ(found.report.translation_directions, 2);
  EXPECT_EQ(found.report.rotation_directions, 1);
  EXPECT_LT(found.report.translation_axes.leftCols<2>().row(2).norm(), 1e-6);
  EXPECT_NEAR(std::abs(found.report.rotation_axes(2, 0)), 1.0, 1e-6);
}

TEST(FindDegeneracy, InformationFeignedByNoisyNormalsDoesNotCount) {
  // Two degrees of noise on the normals of two pairs of walls: without the correction 600 points
  // seem to know x to 0.01 / (0.035 * sqrt(600)) = 12 mm.
  RandomStream random(3);
  Matrix6d A = Matrix6d::Zero(), feigned = Matrix6d::Zero();
  for (int i = 0; i < 600; ++i) {
    const Eigen::Vector3d clean = i % 2 == 0 ? kY : kZ;
    const double tilt = 0.035;
    const Eigen::Vector3d normal = (clean + tilt * random.Normal() * kX).normalized();
    const Eigen::Vector3d p(random.Uniform(-5, 5), random.Uniform(-1, 1), random.Uniform(-1, 1));
    Vector6d h, g;
    h << normal, p.cross(normal);
    g << tilt * kX, p.cross(tilt * kX);
    A += h * h.transpose() / 1e-4;
    feigned += g * g.transpose() / 1e-4;
  }
  DegeneracyConfig config;
  config.max_noise_share = 1.0;
  EXPECT_EQ(FindDegeneracy(A, Matrix6d::Zero(), Eigen::Quaterniond::Identity(), {}, config)
                .report.translation_directions,
            0);
  config.max_noise_share = 0.5;
  const auto found = FindDegeneracy(A, feigned, Eigen::Quaterniond::Identity(), {}, config);
  ASSERT_EQ(found.report.translation_directions, 1);
  EXPECT_GT(std::abs(found.report.translation_axes(0, 0)), 0.999);
}

TEST(FindDegeneracy, ALoneAxisIsAveragedOverSweeps) {
  const Eigen::Vector3d last = Eigen::Vector3d(1.0, 0.02, 0.0).normalized();
  const auto found = FindDegeneracy(InformationOf({kY, kZ}, 200), Matrix6d::Zero(),
                                    Eigen::Quaterniond::Identity(), last, {});
  ASSERT_EQ(found.report.translation_directions, 1);
  EXPECT_NEAR(found.report.translation_axes(1, 0), 0.02, 1e-3);
  EXPECT_TRUE(
      (found.report.translation_axes.transpose() * found.report.translation_axes).isIdentity(1e-9));
}

TEST(Strike, TakesOneOfTwoDegenerateTranslationsOut) {
  DegenerateDirections found = FindDegeneracy(InformationOf({kZ}, 200), Matrix6d::Zero(),
                                              Eigen::Quaterniond::Identity(), {}, {});
  ASSERT_EQ(found.report.translation_directions, 2);
  const Eigen::Matrix3d axes = found.report.translation_axes;
  const std::vector<Vector6d> motions = found.motions;
  Strike(0, found);
  EXPECT_EQ(found.report.translation_directions, 1);
  EXPECT_EQ(found.report.translation_axes.col(0), axes.col(1));
  EXPECT_EQ(found.report.translation_axes.col(1), axes.col(0));
  ASSERT_EQ(found.motions.size(), motions.size() - 1);
  EXPECT_EQ(found.motions[0], motions[1]);
}

TEST(Deflate, RemovesTheInformationAlongAMotionAndKeepsTheRest) {
  const Matrix6d A = InformationOf({kX, kY, kZ}, 50);
  const Vector6d x = (Vector6d() << 0.1, -0.2, 0.3, 0.01, 0.02, -0.03).finished();
  const Vector6d v = (Vector6d() << 1.0, 0.2, 0.0, 0.1, 0.0, 0.0).finished();
  Matrix6d deflated = A;
  Vector6d b = -A * x;
  Deflate({v}, deflated, b);
  EXPECT_LT((deflated * v).norm(), 1e-9 * A.norm());
  EXPECT_LT((b + deflated * x).norm(), 1e-9 * A.norm());  // x solves the deflated equations as well
  for (int i = 0; i < 6; ++i) {
    Vector6d u = Vector6d::Unit(i);
    u -= v * (v.dot(A * u) / v.dot(A * v));  // conjugate to v
    EXPECT_NEAR(u.dot(deflated * u), u.dot(A * u), 1e-9 * A.norm());
  }
}

}  // namespace
}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibration_deviation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mlvi {
namespace {

VioCalibration TwoCameras() {
  VioCalibration calibration;
  calibration.T_pano_camera = {Pose3(ExpSo3({0.3, -1.2, 0.4}), {0.1, 0.0, 0.05}),
                               Pose3(ExpSo3({-0.8, 0.2, 2.0}), {-0.1, 0.02, 0.0})};
  calibration.time_offsets = {0.001, 0.002};
  return calibration;
}

TEST(CalibrationDeviationTest, IsTheAngleAndTheWayWithSigmasAlongThem) {
  const WindowConfig config;
  const VioCalibration nominal = TwoCameras();
  VioCalibration calibration = nominal;
  Pose3& T = calibration.T_pano_camera[1];
  T = Pose3(T.rotation() * ExpSo3({0.0, 0.02, 0.0}),
            T.translation() + T.R() * Eigen::Vector3d(0.0, 0.0, -0.05));
  calibration.time_offsets[1] = -0.001;
  const WindowLayout layout(1, 2, config);
  Eigen::VectorXd sigmas = Eigen::VectorXd::Constant(layout.calibration_size(), 1.0);
  sigmas[layout.camera(1) + 2] = 0.004;  // position along the camera's z
  sigmas[layout.camera(1) + 4] = 0.001;  // rotation about its y
  sigmas[layout.time(1)] = 0.0002;
  const CalibrationDeviation deviation = DeviationFromNominal(
      calibration, nominal, layout, sigmas.cwiseAbs2().asDiagonal().toDenseMatrix());
  ASSERT_EQ(deviation.cameras.size(), 2U);
  EXPECT_EQ(deviation.cameras[0].rotation, 0.0);
  EXPECT_EQ(deviation.cameras[0].translation, 0.0);
  EXPECT_NEAR(deviation.cameras[1].rotation, 0.02, 1e-12);
  EXPECT_NEAR(deviation.cameras[1].rotation_sigma, 0.001, 1e-9);
  EXPECT_NEAR(deviation.cameras[1].translation, 0.05, 1e-12);
  // The shift is seen in the turned axes: 0.02 rad of the 1 m that is known across.
  EXPECT_NEAR(deviation.cameras[1].translation_sigma, std::hypot(0.004, std::sin(0.02)), 1e-4);
  ASSERT_EQ(deviation.time_offsets.size(), 2U);
  EXPECT_EQ(deviation.time_offsets[0].seconds, 0.0);
  EXPECT_EQ(deviation.time_offsets[1].seconds, -0.003);
  EXPECT_NEAR(deviation.time_offsets[1].sigma, 0.0002, 1e-12);
}

// Cameras that move as one have one deviation; time offsets may be all that is estimated.
TEST(CalibrationDeviationTest, OfTheWholeRigAndOfTimeOffsetsAlone) {
  WindowConfig config;
  config.extrinsics = ExtrinsicsCalibration::kRig;
  const VioCalibration nominal = TwoCameras();
  VioCalibration calibration = nominal;
  calibration.T_body_pano = Pose3(ExpSo3({0.01, 0.0, 0.0}), {0.0, 0.002, 0.0});
  const WindowLayout rig(1, 2, config);
  const Eigen::MatrixXd covariance =
      1e-8 * Eigen::MatrixXd::Identity(rig.calibration_size(), rig.calibration_size());
  const CalibrationDeviation together = DeviationFromNominal(calibration, nominal, rig, covariance);
  EXPECT_TRUE(together.together);
  ASSERT_EQ(together.cameras.size(), 2U);
  for (const CalibrationDeviation::Camera& camera : together.cameras) {
    EXPECT_NEAR(camera.rotation, 0.01, 1e-12);
    EXPECT_NEAR(camera.rotation_sigma, 1e-4, 1e-12);
    EXPECT_NEAR(camera.translation, 0.002, 1e-12);
  }
  config.extrinsics = ExtrinsicsCalibration::kOff;
  const CalibrationDeviation time = DeviationFromNominal(
      calibration, nominal, WindowLayout(1, 2, config), 4e-6 * Eigen::MatrixXd::Identity(2, 2));
  EXPECT_TRUE(time.cameras.empty());
  ASSERT_EQ(time.time_offsets.size(), 2U);
  EXPECT_NEAR(time.time_offsets[1].sigma, 0.002, 1e-12);
  config.time_offset = false;
  EXPECT_TRUE(DeviationFromNominal(calibration, nominal, WindowLayout(1, 2, config), {})
                  .time_offsets.empty());
}

}  // namespace
}  // namespace mlvi

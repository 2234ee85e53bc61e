// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/calibration_deviation.h"

#include <cmath>

namespace mlvi {
namespace {

// Along `direction`, or in the mean of all where there is none.
double SigmaAlong(const Eigen::Vector3d& direction, const Eigen::Matrix3d& covariance) {
  const double squared = direction.squaredNorm();
  return std::sqrt(squared > 0.0 ? direction.dot(covariance * direction) / squared
                                 : covariance.trace() / 3.0);
}

CalibrationDeviation::Camera DeviationOf(const Pose3& T, const Pose3& T_nominal,
                                         const Matrix6d& covariance) {
  // In axes of the estimated frame, as the covariance is.
  const Vector6d d = -BoxMinus(T_nominal, T);
  const Eigen::Vector3d moved = d.head<3>(), turned = d.tail<3>();
  return {.rotation = turned.norm(),
          .rotation_sigma = SigmaAlong(turned, covariance.bottomRightCorner<3, 3>()),
          .translation = moved.norm(),
          .translation_sigma = SigmaAlong(moved, covariance.topLeftCorner<3, 3>())};
}

}  // namespace

CalibrationDeviation DeviationFromNominal(const VioCalibration& calibration,
                                          const VioCalibration& nominal, const WindowLayout& layout,
                                          const Eigen::MatrixXd& covariance) {
  CalibrationDeviation result{.together = layout.has_rig(), .cameras = {}, .time_offsets = {}};
  const auto block = [&](int start) { return Matrix6d(covariance.block<6, 6>(start, start)); };
  const std::size_t cameras = calibration.T_pano_camera.size();
  for (std::size_t i = 0; i < cameras && (layout.has_rig() || layout.has_cameras()); ++i) {
    result.cameras.push_back(
        layout.has_rig()
            ? DeviationOf(calibration.T_body_pano, nominal.T_body_pano, block(layout.rig()))
            : DeviationOf(calibration.T_pano_camera[i], nominal.T_pano_camera[i],
                          block(layout.camera(static_cast<int>(i)))));
  }
  for (int i = 0; i < layout.times(); ++i) {
    const auto camera = static_cast<std::size_t>(i);
    result.time_offsets.push_back(
        {.seconds = calibration.time_offsets[camera] - nominal.time_offsets[camera],
         .sigma = std::sqrt(covariance(layout.time(i), layout.time(i)))});
  }
  return result;
}

}  // namespace mlvi

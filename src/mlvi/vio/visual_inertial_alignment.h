// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What first velocity, gravity and biases make the IMU's path agree with the tracks of features
// seen along it: a closed form to begin with, which leaves the IMU's white noise out, and a
// refinement, which estimates what that noise did on the way (over two seconds the rates of an IMU
// of 0.1 degrees/s/sqrt(Hz) are off by more than a pixel).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/panorama/panorama_model.h"
#include "mlvi/vio/inertial_path.h"

namespace mlvi::internal {

// Depths of features are not below this, m.
inline constexpr double kNearest = 0.2;

struct FeatureView {
  std::size_t instant = 0;  // of the path
  PanoramicObservation observation;
};

// The views of one feature, at least two, instants ascending.
using FeatureViews = std::vector<FeatureView>;

struct AlignmentData {
  std::span<const FeatureViews> features;
  Pose3 T_body_pano;
  double pixel_sigma = 1.0;  // px, per axis
};

struct VisualInertialAlignment {
  InertialUnknowns unknowns;
  std::vector<Disturbance> disturbances;  // by instant, the first zero; none of a closed form
  std::vector<double> inverse_depths;     // 1/m, along the ray of each feature's first view; >= 0
};

// Closed form (Martinelli, "Closed-Form Solution of Visual-Inertial Structure from Motion", IJCV
// 2014): with the rotations of the gyroscope, velocity, gravity and all points are linear in the
// condition that points lie on the rays that see them, exactly so for cameras beside the body's
// origin. A few rounds weight the distance from a ray by how far away the point is; |gravity| is
// held to `gravity`. The biases stay those of `bias`.
VisualInertialAlignment AlignTracks(const AlignmentData& data, const InertialPath& path,
                                    const ImuBias& bias, double gravity);

// Of the unknowns, followed by the disturbance of the last instant.
inline constexpr int kAlignmentSize = inertial_index::kSize + kDisturbanceSize;
using AlignmentMatrix = Eigen::Matrix<double, kAlignmentSize, kAlignmentSize>;

struct RefinedAlignment {
  VisualInertialAlignment alignment;
  AlignmentMatrix covariance = AlignmentMatrix::Zero();
  double rms = 0.0;           // of whitened residuals per axis, those of outliers cut
  double inlier_share = 0.0;  // of the residuals within three sigma
  int iterations = 0;
  bool converged = false;
};

// Robust Levenberg-Marquardt over unknowns, disturbances and inverse depths from `initial`; the
// bearing residuals of the estimator, with the prior of `imu` on the biases and its noise on the
// disturbances. Contract: a path of at least two instants.
RefinedAlignment RefineAlignment(const AlignmentData& data, const InertialPath& path,
                                 const VisualInertialAlignment& initial, const ImuSpec& imu);

}  // namespace mlvi::internal

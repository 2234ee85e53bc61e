// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The values that lio, vio, loop and graph exchange: the only words they share.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mlvi/base/id.h"
#include "mlvi/state/nav_state.h"

namespace mlvi {

// Points in a named frame, m.
using PointCloud = std::vector<Eigen::Vector3f>;

// Information of a registration along the six directions of the pose chart (BoxMinus: translation,
// then rotation, in the body frame), and which of them the measurement could not tell.
struct Degeneracy {
  // Of the measurement alone, as far as the estimate heard it: singular along degenerate
  // directions.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  int translation_directions = 0;  // number of degenerate ones, 0..3
  int rotation_directions = 0;
  // Unit directions in the world frame, one column each, in the order of weakness; only the first n
  // are degenerate.
  Eigen::Matrix3d translation_axes = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d rotation_axes = Eigen::Matrix3d::Identity();

  bool any() const { return translation_directions + rotation_directions > 0; }
};

// What an estimate has to do with the local map that its odometry registers in and makes at the
// same time.
struct MapTie {
  // Of the pose in the map, given all measurements (pose chart).
  Matrix6d covariance = Matrix6d::Zero();
  // How many times the map had been replaced before: the sum of -log(1 - share) over the sweeps
  // since its beginning, of whose points `share` were new. Between two estimates the map has been
  // replaced but for exp(age_i - age_j).
  double age = 0.0;
};

// A causal estimate by one odometry, valid at state.stamp.
struct OdometryEstimate {
  NavState state;
  Matrix15d covariance = Matrix15d::Zero();
  Degeneracy degeneracy;
  std::optional<MapTie> map;  // of an odometry that keeps one
};

// A guess of motion from another sensor: the relative pose between two instants with its covariance
// in the pose chart.
struct MotionPrior {
  Time from;
  Time to;
  Pose3 T_from_to;
  Matrix6d covariance = Matrix6d::Zero();
};

using KeyframeId = Id<struct KeyframeTag>;

struct Keyframe {
  KeyframeId id;
  NavState state;                            // as the odometry saw it, in its frame
  std::shared_ptr<const PointCloud> points;  // body frame, deskewed to state.stamp, thinned
};

// A proposed revisit, to be verified.
struct LoopCandidate {
  KeyframeId from;
  KeyframeId to;
  Pose3 T_from_to;  // initial guess
  double score = 0.0;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The filter's view of the state. Its world is that of the local map, which keeps the attitude that
// the first sweeps were given. Gravity is known only as well as the start knew it, so its direction
// in that world is a state: frozen, an error of one degree would push every prediction by 0.17
// m/s^2.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/lio/time_offset.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// Error-state order: the 15 of NavState, then the tilt of gravity (rotation about the world's x and
// y, rad), then the time offset of the LiDAR (s).
inline constexpr int kFilterSize = 18;
inline constexpr int kTilt = 15;
inline constexpr int kTimeOffset = 17;
using FilterVector = Eigen::Matrix<double, kFilterSize, 1>;
using FilterMatrix = Eigen::Matrix<double, kFilterSize, kFilterSize>;

// Valid when the LiDAR's clock shows `nav.stamp`.
struct FilterState {
  NavState nav;
  Eigen::Vector2d tilt =
      Eigen::Vector2d::Zero();  // gravity_world = Exp(tilt_x, tilt_y, 0) (0, 0, -g)
  double time_offset = 0.0;     // TimeOffset::seconds
};

FilterState BoxPlus(const FilterState& state, const FilterVector& delta);
FilterVector BoxMinus(const FilterState& a, const FilterState& b);

struct StateEstimate {
  FilterState mean;
  FilterMatrix covariance = FilterMatrix::Zero();
};

TimeOffset TimeOffsetOf(const StateEstimate& estimate);

// The estimate that follows from first states in the gravity-aligned world with covariance
// `covariance`: the world of the map is defined by the estimated pose, so what is unknown about
// roll and pitch becomes the tilt of gravity, and velocity errors turn along. What a registration
// leaves unknown about the pose is added.
StateEstimate AnchorToMap(const NavState& state, const Matrix15d& covariance,
                          const TimeOffset& time_offset);

// The same in the other direction, for a reader who takes the world's z for the direction of
// gravity: the tilt, both what is known of it and what is not, counts as an error of the attitude
// (turning the world instead would make the trajectory jump whenever the tilt is known better).
// `drift` is the covariance of the map itself, in the chart of the pose (world position, body
// rotation).
Matrix15d ReportedCovariance(const StateEstimate& estimate, const Matrix6d& drift);

// The block of world position and body rotation.
Matrix6d PoseCovariance(const FilterMatrix& covariance);
// Adds to that block.
void AddPoseCovariance(const Matrix6d& pose, Matrix15d& covariance);
void AddPoseCovariance(const Matrix6d& pose, FilterMatrix& covariance);

// The covariance of the map's own error, as seen at the pose of `to`, after a sweep has been
// inserted there of which `new_share` was new. Registration is relative to the map, so its errors
// persist in what is inserted: errors of neighbouring sweeps are alike as long as they are
// registered to the same points, and by the time that the map has been replaced once (shares add up
// to one) one error of a registration has been added. Turned errors act on the way from `from` with
// its length as a lever.
Matrix6d GrownDrift(const Matrix6d& drift, const Pose3& from, const StateEstimate& to,
                    double new_share);

struct Prediction {
  std::vector<NavState> trajectory;  // one per sample
  StateEstimate end;                 // of the last sample
  FilterMatrix transition;           // d(error at the end) / d(error at the start)
};

// Integrates the IMU from `start`, valid at samples.front().stamp. The samples' stamps are those
// that the LiDAR's clock showed, by start.mean.time_offset: what is unknown of it moves both ends
// of the way,
//   d(end)/d(offset) = x'(end) - F x'(start),  x' = (v, R (f - b_a) + g, w - b_g, 0, 0),
// so that changes of rate and acceleration, and nothing else, show it.
Prediction Predict(const StateEstimate& start, std::span<const ImuSample> samples,
                   const ImuSpec& imu, double gravity);

}  // namespace mlvi

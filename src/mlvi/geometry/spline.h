// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Smooth motion: a uniform cubic cumulative B-spline on R^3 x SO(3). Twice continuously
// differentiable, so that an IMU on it reads what a real one reads. References: Kim, Kim and Shin,
// "A general construction scheme for unit quaternion curves" (1995); Sommer et al., "Efficient
// derivative computation for cumulative B-splines on Lie groups" (2020).
#pragma once

#include <span>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"

namespace mlvi {

// Motion of a body in a fixed frame at one instant, exact derivatives of the spline.
struct MotionSample {
  Pose3 T_world_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();              // m/s, world
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          // m/s^2, world, without gravity
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      // rad/s, body
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  // rad/s^2, body
};

class PoseSpline {
 public:
  // `control_poses` (at least 4, neighbours less than pi apart) lie at begin - dt, begin, begin +
  // dt, ...; the spline is defined on [begin, begin + (n - 3) dt] and passes near, in general not
  // through, them.
  PoseSpline(Time begin, Duration knot_interval, std::vector<Pose3> control_poses);

  Time begin() const { return begin_; }
  Time end() const;
  Duration knot_interval() const { return knot_interval_; }
  const std::vector<Pose3>& control_poses() const { return control_poses_; }

  // `time` must lie in [begin(), end()].
  MotionSample At(Time time) const;
  Pose3 PoseAt(Time time) const;

  // The same motion seen from another frame: T_new_body(t) = T_new_world * T_world_body(t).
  PoseSpline Transformed(const Pose3& T_new_world) const;

 private:
  struct Segment {
    std::size_t first = 0;  // index of the first of its four control poses
    double u = 0.0;         // in [0, 1]
  };
  Segment SegmentAt(Time time) const;

  Time begin_;
  Duration knot_interval_;
  std::vector<Pose3> control_poses_;
  std::vector<Eigen::Vector3d> rotation_steps_;  // Log(R_i^-1 R_{i+1})
};

struct SplineFitOptions {
  Duration knot_interval = Duration::FromMilliseconds(50);
  // Weight of squared third differences of the control poses against squared errors of the fit:
  // bridges stretches without poses by the smoothest motion. Small enough that poses are met to
  // micrometres at walking pace.
  double smoothing = 1e-4;
  int max_iterations = 50;  // of the rotations; positions are linear
};

// The spline through `poses[i]` at `stamps[i]`: least squares over the control poses. Needs at
// least two poses with strictly increasing stamps, less than pi apart, else an Error. The spline
// covers [stamps.front(), stamps.back()].
Expected<PoseSpline> FitPoseSpline(std::span<const Time> stamps, std::span<const Pose3> poses,
                                   const SplineFitOptions& options = {});

}  // namespace mlvi

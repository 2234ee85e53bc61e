// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mlvi {

struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, of the carried sensor
  double heading = 0.0;    // rad about z, continuous along the path (not wrapped)
  double curvature = 0.0;  // 1/m, magnitude, in the horizontal plane
  double slope = 0.0;      // height gained per metre of the path, in [-1, 1]
};

// A closed walk through waypoints with rounded corners, by arc length.
class WalkingPath {
 public:
  // `waypoints` (at least 3, m; the last one joins the first) are not met at corners: the polyline
  // is smoothed by a Gaussian of `rounding` m along it.
  WalkingPath(const std::vector<Eigen::Vector3d>& waypoints, double rounding);

  double length() const { return length_; }
  // Any `s` in m; the walk repeats with period length().
  PathPoint At(double s) const;

 private:
  std::vector<PathPoint> samples_;  // at equal steps of s, without the repeated first one
  double length_ = 0.0;
  double turn_ = 0.0;  // heading gained per round
};

// Convolution of a periodic or (held at both ends) open sequence with a Gaussian of `sigma`
// samples.
std::vector<double> SmoothPeriodic(const std::vector<double>& values, double sigma);
std::vector<double> SmoothOpen(const std::vector<double>& values, double sigma);

}  // namespace mlvi

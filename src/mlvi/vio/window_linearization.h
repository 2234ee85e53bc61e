// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Normal equations of the window: bearings, LiDAR depths, IMU, rest, prior, what the rig file says.
//
// Every feature has one unknown of its own, its inverse depth, and is connected to nothing else: it
// is eliminated by a division. What is left couples poses and calibration only, densely, which is
// why a general sparse solver has nothing to gain here (docs/decisions.md).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "mlvi/geometry/robust_kernels.h"
#include "mlvi/vio/window.h"

namespace mlvi {

// Which factors take part.
struct FactorSelection {
  bool bearings = true;
  bool imu = true;
  bool rest = true;
  // Of IMU and rest only what knows the first frame: the connection to the second, its own rest.
  bool first_only = false;
  bool prior = true;
  bool calibration = true;  // what the rig file says
};

// Squared residuals in pixels, before robust weighting.
struct BearingStatistics {
  double sum = 0.0;  // px^2
  int freedom = 0;   // axes that they tell about: two each, one in mode `plane`

  void Add(double squared, int axes) {
    sum += squared;
    freedom += axes;
  }
  void Add(const BearingStatistics& other) {
    sum += other.sum;
    freedom += other.freedom;
  }
  double mean() const { return freedom > 0 ? sum / freedom : 0.0; }  // px^2, per axis
  double rms() const { return std::sqrt(mean()); }                   // px, per axis
};

// H d = b in the coordinates of `layout`, plus one scalar unknown per feature: for feature f
// feature_information[f] d_f + coupling.row(f) d_visual = feature_gradient[f], where the visual
// coordinates are six per frame (its pose) and then the calibration.
struct LinearizedWindow {
  WindowLayout layout;
  Eigen::MatrixXd H;  // upper triangle; features not eliminated
  Eigen::VectorXd b;
  Eigen::MatrixXd coupling;  // features x visual coordinates
  Eigen::VectorXd feature_information, feature_gradient;
  double cost = 0.0;  // sum of rho(|residual|^2) / 2
  std::vector<BearingStatistics> per_camera;

  int visual_size() const { return 6 * layout.frames() + layout.calibration_size(); }
  // Full coordinate of a visual one.
  int FromVisual(int i) const {
    const int poses = 6 * layout.frames();
    return i < poses ? layout.frame(i / 6) + i % 6 : layout.calibration() + i - poses;
  }
};

// px^2, per axis, of a tracked position against the one where the feature is anchored. What a
// tracker follows is by definition what it saw first, and it slips off from set to set.
double BearingVariance(const WindowObservation& anchor, const WindowObservation& target,
                       const WindowConfig& config);

LinearizedWindow Linearize(const VioWindow& window, const WindowConfig& config, double gravity,
                           const FactorSelection& selection = {});

// Mean squared error of each feature, in squared sigmas per axis, at the present estimate; 0 for
// features without a second observation.
std::vector<double> FeatureErrors(const VioWindow& window, const WindowConfig& config);

// Normal equations with all features eliminated. The information of a feature is enlarged by a
// share of itself and by a constant (m^2): the damping of Levenberg and Marquardt.
struct ReducedSystem {
  Eigen::MatrixXd H;  // upper triangle
  Eigen::VectorXd b;
};
ReducedSystem EliminateFeatures(const LinearizedWindow& system, double relative_damping = 0.0,
                                double absolute_damping = 0.0);
// The features' steps for a step of the rest.
Eigen::VectorXd FeatureSteps(const LinearizedWindow& system, const Eigen::VectorXd& step,
                             double relative_damping, double absolute_damping);

}  // namespace mlvi

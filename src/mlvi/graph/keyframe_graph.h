// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The factor graph over keyframes (paper SIII-C): IMU preintegration, LiDAR odometry, visual
// odometry and loop factors, solved by iSAM2.
//
// LiDAR odometry does not tell steps from keyframe to keyframe but where each lies in the
// odometry's local map, which outlives what single keyframes cannot see. So the map is a variable
// of the graph, too: at each keyframe the pose that it gives the body. A registration binds pose
// and map along the directions that it told; the map moves on by MapStepFactor, as far as its
// points are replaced. Beyond a stretch that left a direction open the map still holds it, the IMU
// tells the way between, and nothing counts twice.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/base/error.h"
#include "mlvi/imu/preintegration.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/solver/incremental_smoother.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

struct GraphConfig {
  double keyframe_distance = 1.0;
  double keyframe_angle = 0.35;
  double keyframe_interval = 5.0;
  double map_position_sigma = 3e-4;
  double map_rotation_sigma = 3e-5;
  double relinearize_threshold = 0.05;
  double loop_loss_scale = 1.0;
  double visual_loss_scale = 1.0;
  void Declare(ConfigDeclaration& d);
};

// What one addition to the graph did.
struct GraphUpdate {
  KeyframeId keyframe;
  NavState newest;       // smoothed state of the newest keyframe
  Matrix15d covariance;  // its marginal (order of nav_index)
  // Metres, of the newest keyframe against the odometry that was added.
  double largest_position_change = 0.0;
  IncrementalSmootherSummary solver;
};

class KeyframeGraph {
 public:
  // `rig` gives IMU noise and gravity.
  KeyframeGraph(const GraphConfig& config, const Rig& rig);

  // Whether `state` is far enough from the newest keyframe (distance, angle or time), or the first.
  bool WantsKeyframe(const NavState& state) const;

  // Adds `estimate` as a keyframe with an IMU factor over `imu` (samples from the newest keyframe
  // to this one, as SamplesBetween gives them), the map of its odometry and the registration there,
  // if it keeps one, and a robust factor of the `visual` motion since the newest keyframe, if there
  // is one. The first keyframe takes a prior from the estimate's covariance instead and is where
  // the map begins. Errors (kEstimation) leave the graph as it was.
  Expected<GraphUpdate> Add(const OdometryEstimate& estimate,
                            std::shared_ptr<const PointCloud> points,
                            std::span<const ImuSample> imu,
                            const std::optional<MotionPrior>& visual = std::nullopt);

  // The same after a loss: a new map and no IMU factor over the gap, but what is known of the
  // motion from the newest keyframe by its `gap` covariance (pose chart of `estimate`, may be very
  // large), and what a new start knows by itself: roll, pitch and biases; of its speed only the
  // order of magnitude, for the heading may be corrected by any angle later. Needs a keyframe.
  Expected<GraphUpdate> AddAfterGap(const OdometryEstimate& estimate,
                                    std::shared_ptr<const PointCloud> points, const Matrix6d& gap);

  // Adds a verified loop closure: T_from_to measured with `covariance` in the pose chart; robust.
  Expected<GraphUpdate> AddLoop(KeyframeId from, KeyframeId to, const Pose3& T_from_to,
                                const Matrix6d& covariance);

  // The smoothed state of a keyframe.
  NavState Estimate(KeyframeId id) const;
  // As added: ids count from 0.
  const std::vector<Keyframe>& keyframes() const { return keyframes_; }
  int loops() const { return loops_; }

 private:
  struct Variables {
    VariableId pose, velocity, bias;
    // The pose by the odometry's map; that of the keyframe itself where the map begins.
    VariableId map;
  };

  // `estimate` moved from the odometry's frame to where its step from the newest keyframe leads in
  // the graph.
  NavState Guess(const OdometryEstimate& estimate) const;
  // Solves with a new keyframe, or takes it back.
  Expected<GraphUpdate> Commit(const OdometryEstimate& estimate, const NavState& guess,
                               const Variables& added, std::shared_ptr<const PointCloud> points);
  Variables AddVariables(const NavState& state);
  VariableId AddPose(const Pose3& pose);
  // The map of `to` behind that of the newest keyframe, and the registration of `to` in it.
  void AddMap(const OdometryEstimate& to, const NavState& guess, Variables& added);
  void AddMapStep(const OdometryEstimate& to, VariableId map);
  void AddPrior(const OdometryEstimate& estimate, const Variables& at);
  void AddTiltPrior(const OdometryEstimate& estimate, const Variables& at);
  void AddBiasPrior(const OdometryEstimate& estimate, const Variables& at);
  void AddImuFactor(const Variables& from, const Variables& to, std::span<const ImuSample> imu,
                    const ImuBias& bias);
  void AddVisualOdometryFactor(const MotionPrior& motion, const Variables& to_variables);
  Expected<GraphUpdate> Solve();
  Matrix15d Covariance(const Variables& variables) const;

  GraphConfig config_;
  ImuSpec imu_;
  double gravity_;
  IncrementalSmoother smoother_;
  std::vector<Keyframe> keyframes_;
  std::vector<Variables> variables_;
  std::optional<OdometryEstimate> newest_;  // the odometry of the newest keyframe
  int loops_ = 0;
};

}  // namespace mlvi

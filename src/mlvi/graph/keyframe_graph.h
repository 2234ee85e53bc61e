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

// What an odometry gives at one time: a single estimate, or all those of a start, ascending in time.
struct EstimateBatch {
  std::span<const OdometryEstimate> estimates;
  std::span<const std::shared_ptr<const PointCloud>> clouds;  // one per estimate
  // Of every estimate but the last, its pose as seen from the last one, T_last_k (pose chart).
  std::span<const Matrix6d> relative;
};

class KeyframeGraph {
 public:
  // `rig` gives IMU noise and gravity.
  KeyframeGraph(const GraphConfig& config, const Rig& rig);

  // Whether `state` is far enough from the newest keyframe (distance, angle or time), or the first.
  bool WantsKeyframe(const NavState& state) const;

  // Begins with the states of a start. They are one estimate from the same measurements, which must
  // not count twice: the last one takes its covariance as prior and is where the map begins.
  // Earlier ones that are keyframes by distance, angle or time hang on it by their poses as the
  // start saw them, with the `relative` covariances. Errors (kEstimation) leave the graph as it
  // was.
  Expected<GraphUpdate> Begin(const EstimateBatch& start);

  // Adds `estimate` as a keyframe with an IMU factor over `imu` (samples from the newest keyframe
  // to this one, as SamplesBetween gives them), the map of its odometry and the registration there,
  // if it keeps one, and a robust factor of the `visual` motion since the newest keyframe, if there
  // is one. Needs a keyframe; errors as those of Begin.
  Expected<GraphUpdate> Add(const OdometryEstimate& estimate,
                            std::shared_ptr<const PointCloud> points,
                            std::span<const ImuSample> imu,
                            const std::optional<MotionPrior>& visual = std::nullopt);

  // Begin after a loss: a new map and no IMU factor over the gap, but what is known of the motion
  // from the newest keyframe to the last state of the `start` by its `gap` covariance (pose chart
  // of that state, may be very large), and what a new start knows by itself: roll, pitch and
  // biases; of its speed only the order of magnitude, for the heading may be corrected by any angle
  // later. Needs a keyframe.
  Expected<GraphUpdate> BeginAfterGap(const EstimateBatch& start, const Matrix6d& gap);

  // Adds a verified loop closure: T_from_to measured with `covariance` in the pose chart; robust.
  // Settles.
  Expected<GraphUpdate> AddLoop(KeyframeId from, KeyframeId to, const Pose3& T_from_to,
                                const Matrix6d& covariance);

  // Solves on until nothing is left to be linearised anew, in a bounded number of steps
  // (converged()): each addition leaves small changes to the next one. Needs a keyframe.
  Expected<GraphUpdate> Settle();
  // Whether the last solution left nothing to be linearised anew.
  bool converged() const { return !update_ || update_->solver.stale_variables == 0; }

  // The smoothed state of a keyframe. Velocity and biases of those before the last state of a start
  // are the odometry's.
  NavState Estimate(KeyframeId id) const;
  // As added, ascending in time: ids count from 0.
  const std::vector<Keyframe>& keyframes() const { return keyframes_; }
  // What the last successful call said of the newest keyframe.
  const std::optional<GraphUpdate>& newest() const { return update_; }
  int loops() const { return loops_; }

 private:
  struct Variables {
    // Of a keyframe before the last state of a start, the pose alone.
    VariableId pose, velocity, bias;
    // The pose by the odometry's map; that of the keyframe itself where the map begins.
    VariableId map;
  };

  // The odometry's frame moved to where its step from the newest keyframe leads in the graph.
  Pose3 FrameOfGuess() const;
  std::vector<std::size_t> KeyframesOf(std::span<const OdometryEstimate> start) const;
  // Returns the variables of the last state; what ties them to the rest is left to the caller.
  Variables AddStart(const EstimateBatch& start);
  void AddKeyframe(const OdometryEstimate& estimate, const Variables& variables,
                   std::shared_ptr<const PointCloud> points);
  // Solves with the keyframes since the first `before`, whose last one is `newest`, or takes them
  // back.
  Expected<GraphUpdate> Commit(std::size_t before, const OdometryEstimate& newest);
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
  GraphUpdate Updated(const IncrementalSmootherSummary& solver);
  Matrix15d Covariance(const Variables& variables) const;

  GraphConfig config_;
  ImuSpec imu_;
  double gravity_;
  IncrementalSmoother smoother_;
  std::vector<Keyframe> keyframes_;
  std::vector<Variables> variables_;
  std::optional<OdometryEstimate> newest_;  // the odometry of the newest keyframe
  std::optional<GraphUpdate> update_;
  int loops_ = 0;
};

}  // namespace mlvi

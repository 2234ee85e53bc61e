// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The whole system: measurements in, trajectory and keyframes out. Synchronous and deterministic;
// ordering, health and the estimators each are a class of their own.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/base/stage_times.h"
#include "mlvi/geometry/stamped_pose.h"
#include "mlvi/graph/keyframe_graph.h"
#include "mlvi/lio/lio.h"
#include "mlvi/pipeline/imu_buffer.h"
#include "mlvi/pipeline/motion_chain.h"
#include "mlvi/pipeline/sequencer.h"
#include "mlvi/pipeline/supervisor.h"
#include "mlvi/pipeline/visual_odometry.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/estimates.h"
#include "mlvi/state/health.h"

namespace mlvi {

enum class GraphFeedback : int { kNever = 0, kAfterLoops = 1, kAlways = 2 };

struct SlamConfig {
  SequencerConfig sequencer;
  LioConfig lio;
  GraphConfig graph;
  GraphFeedback feedback = GraphFeedback::kAfterLoops;
  VisualConfig visual;
  SupervisorConfig supervisor;
  void Declare(ConfigDeclaration& d);
};

// Errors (kConfiguration): what keeps a valid rig (Rig::Validate) from being used with `config`.
Expected<void> CheckRig(const SlamConfig& config, const Rig& rig);

class Slam {
 public:
  // `config` must pass ConfigDeclaration::Check, `rig` CheckRig; all its sensors are used. With a LiDAR its odometry is the estimate; cameras
  // alone give one, too.
  Slam(const SlamConfig& config, const Rig& rig);

  // Takes one measurement in arrival order.
  void Process(const Measurement& measurement);
  // Ends the recording: processes what was held back and concludes the report. Call once; also
  // after an interruption. `dropped`: measurements that did not even come here, by stream ("imu",
  // "lidar", a camera's name) and reason.
  void Finish(const DropCounts& dropped = {});

  // Events reach subscribers while Process runs.
  EventBus& events() { return events_; }

  // T_world_body at the last firing of each sweep (without LiDAR: at each set of images), causal:
  // as it was when the sweep came in, with the correction by the graph that was known then
  // (SlamConfig::feedback).
  const Trajectory& odometry() const { return odometry_; }
  // The same instants after smoothing: every sweep moves with its keyframe.
  Trajectory SmoothedTrajectory() const;
  // The newest state propagated to the newest IMU sample; empty before the start and while track is
  // lost.
  const std::optional<NavState>& current() const { return current_; }
  // The newest filtered estimate with covariance and degeneracy, in the world.
  const std::optional<OdometryEstimate>& newest() const { return newest_; }
  // The frame in which the odometry runs, seen from the world: what the graph has corrected so far.
  // Keyframes hold their poses in the odometry's frame, `graph()` knows them in the world.
  const Pose3& T_world_odometry() const { return T_world_odometry_; }
  // IMU samples kept for the next sweep and keyframe: bounded.
  std::size_t imu_samples() const { return imu_.size(); }

  const KeyframeGraph& graph() const { return graph_; }
  const Supervisor& supervisor() const { return supervisor_; }
  // What is known of the LiDAR's clock; the estimates' stamps are its own.
  const TimeOffset& lidar_time_offset() const { return lidar_time_offset_; }
  // Whether the motion has shown it.
  bool KnowsTimeOffset() const;
  // Null without cameras.
  const VisualOdometry* visual() const { return visual_ ? &*visual_ : nullptr; }
  // Every stream by name, those of the cameras included.
  std::map<std::string, StreamReport> Streams() const;
  const StageTimes& times() const { return *times_; }

 private:
  // A sweep's pose relative to the keyframe that it moves with.
  struct Anchored {
    Time stamp;
    KeyframeId keyframe;
    Pose3 T_keyframe_body;
  };

  void ProcessOrdered(const Measurement& measurement);
  void ProcessImu(const ImuSample& sample);
  void ReleaseSweeps();
  void ProcessSweep(const LidarSweep& sweep);
  void ProcessImages(const ImageSet& set);
  // All estimates that one measurement gave.
  void TakeEstimates(const EstimateBatch& batch);
  void AddKeyframes(const EstimateBatch& batch);
  void Anchor(const OdometryEstimate& estimate, std::size_t first_keyframe);
  bool TakesFeedback() const;
  Expected<GraphUpdate> AddToGraph(const EstimateBatch& batch);
  void SettleGraph();
  void TellTimeOffset();
  void PropagateFromNewest();
  std::vector<ImuSample> ImuBetweenEstimates(Time from, Time to) const;

  SlamConfig config_;
  Rig rig_;
  EventBus events_;
  std::unique_ptr<StageTimes> times_;  // stable address: Lio keeps a reference
  Sequencer sequencer_;
  Supervisor supervisor_;
  std::optional<Lio> lio_;
  std::optional<VisualOdometry> visual_;
  KeyframeGraph graph_;
  ImuBuffer imu_;
  Time newest_imu_;
  std::deque<LidarSweep> sweeps_;  // those that the IMU has not reached the end of
  Time imu_needed_from_;           // start of the next interval to be handed to the LiDAR odometry
  Time last_sweep_end_;            // by the LiDAR's clock
  Time images_needed_from_;        // the same of the visual odometry
  MotionChain visual_motion_;      // of the odometry from images alone, since the newest keyframe
  TimeOffset lidar_time_offset_;
  Duration odometry_offset_;  // from the clock that stamps the estimates to the IMU's
  Pose3 T_world_odometry_;
  std::optional<Matrix6d> gap_;  // LioResult::gap, until a keyframe stands behind it
  Trajectory odometry_;
  std::vector<Anchored> anchored_;
  std::optional<NavState> current_;
  std::optional<OdometryEstimate> newest_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Watches the streams and the odometry: counts, health with reasons, and events for the user. It judges, it does not
// estimate.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/lio/lio.h"
#include "mlvi/pipeline/stream_report.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/health.h"

namespace mlvi {

struct SupervisorConfig {
  double imu_gap_periods = 5.0;   // nominal periods
  double lidar_gap_periods = 2.5; // nominal periods
  int lost_after = 10;            // sweeps
  double degraded_share = 0.2;
  void Declare(ConfigDeclaration& d);
};

// Track was lost and a new start begun.
struct ResetReport {
  Time lost;     // start of the sweep at which the odometry gave up
  Time resumed;  // first estimate after it; invalid if none came
  std::int64_t sweeps_without_pose = 0;  // of those that arrived after the loss
  std::string reason;
};

struct OdometryReport {
  std::int64_t sweeps_degenerate = 0;  // with at least one degenerate direction
  std::int64_t sweeps_unconverged = 0;
  std::int64_t translation_degenerate = 0, rotation_degenerate = 0;
  // Mean over degenerate sweeps of the absolute components of the weakest translation axis in the world frame.
  Eigen::Vector3d mean_weak_translation_axis = Eigen::Vector3d::Zero();
  bool initialized = false;
  Time first_estimate;
  std::int64_t sweeps_before_start = 0;  // given to the initialisation without coming back as estimates
  std::vector<ResetReport> resets;
  // At the end, or since sweeps of bad registration whose poses are in the trajectory. A new start that comes about ends
  // it.
  bool lost = false;
  std::string lost_reason;
};

class Supervisor {
 public:
  // `events` must outlive the instance.
  Supervisor(const SupervisorConfig& config, const Rig& rig, const EventBus& events);

  void Observe(const ImuSample& sample);
  void Observe(const LidarSweep& sweep, const LioResult& result);
  // Takes over what the sequencer dropped, by stream.
  void AddDropped(const std::map<std::string, std::map<std::string, std::int64_t>>& dropped);
  // Judges the whole run; call once at its end.
  void Conclude();

  const std::map<std::string, StreamReport>& streams() const { return streams_; }
  const OdometryReport& odometry() const { return odometry_; }

 private:
  void ObserveGap(const std::string& name, Time previous, Time now, double limit, const std::string& remedy);
  void ObserveTracking(const LidarSweep& sweep, const LioResult& result);
  void ObserveReset(const LidarSweep& sweep, const LioResult& result);
  void ObserveFailures(const LidarSweep& sweep, const LioResult& result);

  SupervisorConfig config_;
  ImuSpec imu_;
  double lidar_period_ = 0.1;
  const EventBus& events_;
  std::map<std::string, StreamReport> streams_;
  OdometryReport odometry_;
  Time last_imu_, last_sweep_end_;
  std::int64_t saturated_ = 0;
  std::int64_t pending_sweeps_ = 0;
  int failures_in_a_row_ = 0;
};

}  // namespace mlvi

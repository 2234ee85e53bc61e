// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Watches the streams and the odometry: counts, health with reasons, and events for the user. It
// judges, it does not estimate.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/config.h"
#include "mlvi/lio/lio.h"
#include "mlvi/pipeline/imu_watch.h"
#include "mlvi/pipeline/mount_watch.h"
#include "mlvi/pipeline/rate_watch.h"
#include "mlvi/pipeline/stream_report.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/health.h"

namespace mlvi {

struct SupervisorConfig {
  double imu_gap_periods = 5.0;    // nominal periods
  double lidar_gap_periods = 2.5;  // nominal periods
  int lost_after_sweeps = 10;
  double degraded_share = 0.2;
  double rate_tolerance = 0.2;
  double missing_share = 0.1;
  double max_bias_sigmas = 5.0;
  void Declare(ConfigDeclaration& d);
};

// Track was lost and a new start begun.
struct ResetReport {
  Time lost;                             // start of the sweep at which the odometry gave up
  Time resumed;                          // first estimate after it; invalid if none came
  std::int64_t sweeps_without_pose = 0;  // of those that arrived after the loss
  std::string reason;
};

struct OdometryReport {
  std::int64_t sweeps_degenerate = 0;  // with at least one degenerate direction
  std::int64_t sweeps_unconverged = 0;
  std::int64_t translation_degenerate = 0, rotation_degenerate = 0;
  // Mean over degenerate sweeps of the absolute components of the weakest translation axis in the
  // world frame.
  Eigen::Vector3d mean_weak_translation_axis = Eigen::Vector3d::Zero();
  bool initialized = false;
  Time first_estimate;
  // Given to the initialisation without coming back as estimates.
  std::int64_t sweeps_before_start = 0;
  std::vector<ResetReport> resets;
  // At the end, or since sweeps of bad registration whose poses are in the trajectory. A new start
  // that comes about ends it.
  bool lost = false;
  std::string lost_reason;
  std::string waiting_for;  // of the start, as long as there is none
  Health health;            // whether the estimate agrees with the IMU and the rig
};

class Supervisor {
 public:
  // `events` must outlive the instance.
  Supervisor(const SupervisorConfig& config, const Rig& rig, const EventBus& events);

  void Observe(const ImuSample& sample);
  // `imu`: what the odometry was given with the sweep.
  void Observe(const LidarSweep& sweep, const LioResult& result,
               std::span<const ImuSample> imu = {});
  // Takes over what was dropped elsewhere, by stream and reason.
  void AddDropped(const DropCounts& dropped);
  // Judges the whole run; call once at its end.
  void Conclude();

  const std::map<std::string, StreamReport>& streams() const { return streams_; }
  const OdometryReport& odometry() const { return odometry_; }

 private:
  // How a stream's distances of measurements are judged.
  struct Pace {
    RateWatch rate;
    double period;  // s, by the rig
    double gap_periods;
    std::string gap_key;   // configuration
    std::string what;      // the measurements
    std::string rate_key;  // rig file
    bool announced = false;
    Time newest = {};
  };

  void ObservePace(const std::string& name, Pace& pace, Time now, const std::string& remedy);
  void ObserveGap(const std::string& name, const Pace& pace, Time now, const std::string& remedy);
  void AnnounceImu(Time now);
  Health Judge(const std::string& name, const StreamReport& report) const;
  void ObserveTracking(const LidarSweep& sweep, const LioResult& result);
  void ObserveReset(const LidarSweep& sweep, const LioResult& result);
  void ObserveFailures(const LidarSweep& sweep, const LioResult& result);
  void DeclareLost(Time stamp, const std::string& reason, const std::string& advice);

  SupervisorConfig config_;
  ImuWatch imu_;
  MountWatch mount_;
  const EventBus& events_;
  std::map<std::string, StreamReport> streams_;
  OdometryReport odometry_;
  std::map<std::string, Pace> paces_;  // of the streams that have one
  bool imu_announced_ = false;
  std::int64_t pending_sweeps_ = 0;
  int failures_in_a_row_ = 0;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// LiDAR-inertial odometry (LIO-SAM lineage): deskew, features, scan-to-map registration as a MAP
// estimate over the IMU-predicted state, local map.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/stage_times.h"
#include "mlvi/lio/lio_config.h"
#include "mlvi/lio/time_offset.h"
#include "mlvi/sensors/measurements.h"
#include "mlvi/sensors/rig.h"
#include "mlvi/state/estimates.h"

namespace mlvi {

// What became of one sweep.
struct LioResult {
  enum class Status {
    kInitializing,  // kept back until the first states are known
    kTracking,  // `estimates` holds the new state (after initialisation: those of all sweeps kept
                // back)
    kRejected,  // not used; see `reason`
  };
  Status status = Status::kInitializing;
  std::string reason;     // why rejected, or what the start waits for; of a sweep in use: remarks,
                          // mostly empty
  std::string rejection;  // the kind of rejection, to be counted: "empty sweep", "out of order",
                          // ...; else empty
  // Ascending in time; each is valid at the last firing of its sweep, to which the sweep is
  // deskewed. Those of a start are one estimate from the same measurements: the last one is the
  // first of the filter, and the only one with a map tie.
  std::vector<OdometryEstimate> estimates;
  // Of every estimate of a start but the last, its pose as seen from the last one, T_last_k (pose
  // chart). Empty beside a single estimate.
  std::vector<Matrix6d> relative;
  // One per estimate: the deskewed, thinned sweep in the body frame at that instant.
  std::vector<std::shared_ptr<const PointCloud>> clouds;
  // Figures of the last registration.
  int correspondences = 0;
  int iterations = 0;
  double rms_residual = 0.0;  // m
  bool converged = false;
  double new_share = 0.0;  // of the sweep's points, those that were new to the local map
  TimeOffset time_offset;  // estimates are stamped by the LiDAR's clock
  // A reset: track was lost, for `reason`, and a new start begins with this sweep.
  bool lost = false;
  // With the estimates of a start after a reset: covariance of the motion from the last estimate
  // before it to the last of these, in the pose chart of the latter. It may be very large.
  std::optional<Matrix6d> gap;
};

class Lio {
 public:
  // `times` collects the stages' wall times and must outlive the instance. The rig must have a
  // LiDAR.
  Lio(const LioConfig& config, const Rig& rig, StageTimes& times);
  ~Lio();

  // `imu` covers the time from the end of the previous sweep (or from the start of this one) to
  // sweep.end(), and further by the time offset that is known so far, where it is positive.
  // `guess` is the motion by another sensor since the previous estimate, if one is healthy.
  LioResult Process(const LidarSweep& sweep, std::span<const ImuSample> imu,
                    const std::optional<MotionPrior>& guess = std::nullopt);

  // IMU samples kept for the next sweep: bounded, whatever becomes of the sweeps.
  std::size_t imu_samples() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mlvi

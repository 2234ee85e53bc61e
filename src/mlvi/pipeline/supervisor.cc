// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/supervisor.h"

#include <fmt/format.h>

#include <algorithm>

namespace mlvi {
namespace {

bool IsSaturated(const ImuSample& sample, const ImuSpec& imu) {
  return sample.linear_acceleration.cwiseAbs().maxCoeff() >= 0.999 * imu.accelerometer_saturation ||
         sample.angular_velocity.cwiseAbs().maxCoeff() >= 0.999 * imu.gyroscope_saturation;
}

std::int64_t Sum(const std::map<std::string, std::int64_t>& counts) {
  std::int64_t sum = 0;
  for (const auto& [reason, count] : counts) sum += count;
  return sum;
}

}  // namespace

void SupervisorConfig::Declare(ConfigDeclaration& d) {
  d.Field("imu_gap_periods", imu_gap_periods, "periods", "A longer distance of IMU samples is a gap", {1.5, 1e4});
  d.Field("lidar_gap_periods", lidar_gap_periods, "periods", "A longer distance of sweeps is a gap", {1.1, 1e4});
  d.Field("lost_after", lost_after, "sweeps",
          "So many sweeps in a row without a valid registration, and the odometry counts as lost", {1, 1e6});
  d.Field("degraded_share", degraded_share, "",
          "A stream with a larger share of dropped measurements is degraded", {0.0, 1.0});
}

Supervisor::Supervisor(const SupervisorConfig& config, const Rig& rig, const EventBus& events)
    : config_(config), imu_(rig.imu), events_(events) {
  streams_["imu"];
  if (rig.lidar) {
    streams_["lidar"];
    lidar_period_ = 1.0 / rig.lidar->rate_hz;
  }
}

void Supervisor::Observe(const ImuSample& sample) {
  StreamReport& report = streams_["imu"];
  ++report.received;
  ++report.used;
  if (IsSaturated(sample, imu_)) ++saturated_;
  ObserveGap("imu", last_imu_, sample.stamp, config_.imu_gap_periods / imu_.rate_hz,
             "motion is held over the gap with grown uncertainty");
  last_imu_ = sample.stamp;
}

void Supervisor::Observe(const LidarSweep& sweep, const LioResult& result) {
  StreamReport& report = streams_["lidar"];
  ++report.received;
  ObserveGap("lidar", last_sweep_end_, sweep.end(), config_.lidar_gap_periods * lidar_period_,
             "the IMU alone carries the estimate over the gap");
  last_sweep_end_ = sweep.end();
  if (result.status == LioResult::Status::kRejected) {
    if (report.dropped[result.rejection]++ == 0) {
      events_.Raise({.stamp = sweep.stamp, .severity = Severity::kWarning, .source = "lidar",
                     .message = "sweep not used: " + result.reason + ". Further ones are counted in the summary."});
    }
  } else if (result.status == LioResult::Status::kTracking) {
    report.used += static_cast<std::int64_t>(result.estimates.size());
  } else {
    ++pending_sweeps_;
  }
  ObserveTracking(sweep, result);
}

void Supervisor::ObserveTracking(const LidarSweep& sweep, const LioResult& result) {
  const bool tracking = result.status == LioResult::Status::kTracking;
  if (tracking && !odometry_.initialized) {
    odometry_.initialized = true;
    odometry_.first_estimate = result.estimates.front().state.stamp;
    odometry_.sweeps_before_start =
        pending_sweeps_ + 1 - static_cast<std::int64_t>(result.estimates.size());
  }
  if (!odometry_.initialized) return;
  ObserveReset(sweep, result);
  if (tracking) {
    const Degeneracy& degeneracy = result.estimates.back().degeneracy;
    if (!result.converged) ++odometry_.sweeps_unconverged;
    if (degeneracy.any()) ++odometry_.sweeps_degenerate;
    if (degeneracy.rotation_directions > 0) ++odometry_.rotation_degenerate;
    if (degeneracy.translation_directions > 0) {
      ++odometry_.translation_degenerate;
      odometry_.mean_weak_translation_axis += degeneracy.translation_axes.col(0).cwiseAbs();
    }
  }
  ObserveFailures(sweep, result);
}

void Supervisor::ObserveReset(const LidarSweep& sweep, const LioResult& result) {
  if (result.lost) {
    odometry_.resets.push_back({.lost = sweep.stamp, .resumed = Time(), .reason = result.reason});
    odometry_.lost = true;
    odometry_.lost_reason = fmt::format("track lost at {}: {}", ToString(sweep.stamp), result.reason);
    failures_in_a_row_ = 0;
    events_.Raise({.stamp = sweep.stamp, .severity = Severity::kError, .source = "lio",
                   .message = odometry_.lost_reason +
                              ". What was estimated before is kept. If the recording was interrupted here, evaluate its parts "
                              "one by one; else see whether LiDAR and IMU deliver (gaps in the summary), or raise "
                              "lio.lost_after."});
  }
  if (odometry_.resets.empty() || odometry_.resets.back().resumed.valid()) return;
  ResetReport& reset = odometry_.resets.back();
  ++reset.sweeps_without_pose;
  if (result.status != LioResult::Status::kTracking) return;
  reset.resumed = result.estimates.front().state.stamp;
  reset.sweeps_without_pose -= static_cast<std::int64_t>(result.estimates.size());
  odometry_.lost = false;
  odometry_.lost_reason.clear();
  events_.Raise({.stamp = reset.resumed, .severity = Severity::kInfo, .source = "lio",
                 .message = fmt::format("track found again at {} ({})", ToString(reset.resumed), result.reason)});
}

void Supervisor::ObserveFailures(const LidarSweep& sweep, const LioResult& result) {
  if (result.status == LioResult::Status::kInitializing) return;  // a new start takes its time
  const bool registered = result.status == LioResult::Status::kTracking && (result.converged || result.gap);
  failures_in_a_row_ = registered ? 0 : failures_in_a_row_ + 1;
  if (failures_in_a_row_ != config_.lost_after) return;
  odometry_.lost = true;
  odometry_.lost_reason = fmt::format(
      "{} sweeps in a row before {} without a valid registration (last: {} correspondences{}{})", config_.lost_after,
      ToString(sweep.stamp), result.correspondences, result.reason.empty() ? "" : ", ", result.reason);
  events_.Raise({.stamp = sweep.stamp, .severity = Severity::kError, .source = "lio",
                 .message = odometry_.lost_reason +
                            ". Likely wrong extrinsics, a LiDAR that sees too little, or motion beyond the IMU's "
                            "range; the poses from there on are not to be trusted."});
}

void Supervisor::ObserveGap(const std::string& name, Time previous, Time now, double limit,
                            const std::string& remedy) {
  if (!previous.valid()) return;
  const double gap = (now - previous).seconds();
  if (gap <= limit) return;
  StreamReport& report = streams_[name];
  report.longest_gap = std::max(report.longest_gap, gap);
  if (report.gaps++ == 0) {
    events_.Raise({.stamp = now, .severity = Severity::kWarning, .source = name,
                   .message = fmt::format("gap of {:.3f} s before {} (nominal period below {:.4f} s): {}. Further gaps "
                                          "are counted in the summary.",
                                          gap, ToString(now), limit, remedy)});
  }
}

void Supervisor::AddDropped(const std::map<std::string, std::map<std::string, std::int64_t>>& dropped) {
  for (const auto& [name, reasons] : dropped) {
    if (!streams_.contains(name)) continue;  // a camera: CameraWatch takes it over
    for (const auto& [reason, count] : reasons) {
      streams_[name].dropped[reason] += count;
      streams_[name].received += count;
    }
  }
}

void Supervisor::Conclude() {
  for (auto& [name, report] : streams_) {
    const std::int64_t lost = Sum(report.dropped);
    if (report.used == 0) {
      report.health = {HealthLevel::kFailed, report.received == 0 ? "no measurement arrived" : "no measurement used"};
    } else if (static_cast<double>(lost) > config_.degraded_share * static_cast<double>(report.received)) {
      report.health = {HealthLevel::kDegraded, fmt::format("{} of {} measurements dropped", lost, report.received)};
    } else if (report.dropped.contains("stamp goes back in time")) {
      report.health = {HealthLevel::kDegraded, fmt::format("time jumped back, {} measurements dropped until it was passed",
                                                           report.dropped.at("stamp goes back in time"))};
    } else if (report.gaps > 0) {
      report.health = {HealthLevel::kDegraded,
                       fmt::format("{} gaps, the longest {:.3f} s", report.gaps, report.longest_gap)};
    }
  }
  if (saturated_ > 0 && streams_["imu"].health.level == HealthLevel::kHealthy) {
    streams_["imu"].health = {HealthLevel::kDegraded, fmt::format("{} samples at saturation", saturated_)};
  }
  if (odometry_.translation_degenerate > 0) {
    odometry_.mean_weak_translation_axis /= static_cast<double>(odometry_.translation_degenerate);
  }
}

}  // namespace mlvi

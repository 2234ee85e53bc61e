// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/pipeline/supervisor.h"

#include <fmt/format.h>

#include <algorithm>

#include "mlvi/pipeline/sequencer.h"

namespace mlvi {
namespace {

// When findings about a stream as a whole are announced for the first time.
constexpr std::int64_t kEarlyIntervals = 50;
constexpr std::int64_t kEarlySamples = 200;

}  // namespace

void SupervisorConfig::Declare(ConfigDeclaration& d) {
  d.Field("imu_gap_periods", imu_gap_periods, "periods",
          "A longer distance of IMU samples is a gap", {1.5, 1e4});
  d.Field("lidar_gap_periods", lidar_gap_periods, "periods", "A longer distance of sweeps is a gap",
          {1.1, 1e4});
  d.Field("lost_after_sweeps", lost_after_sweeps, "sweeps",
          "So many sweeps in a row without a valid registration, and the odometry counts as lost",
          {1, 1e6});
  d.Field("degraded_share", degraded_share, "",
          "A stream with a larger share of dropped measurements is degraded", {0.0, 1.0});
  d.Field("rate_tolerance", rate_tolerance, "",
          "A stream whose rate is farther from the rig's, relatively, is degraded", {0.01, 1e4});
  d.Field("missing_share", missing_share, "",
          "A stream that lacks a larger share of measurements between others is degraded",
          {0.001, 1.0});
  d.Field("max_bias_sigmas", max_bias_sigmas, "",
          "A larger bias at the end, in initial sigmas of the rig's IMU and per axis, degrades the "
          "odometry",
          {1.0, 1e4});
}

Supervisor::Supervisor(const SupervisorConfig& config, const Rig& rig, const EventBus& events)
    : config_(config),
      imu_(rig.imu, rig.gravity),
      mount_(rig, MountLimits{.bias_sigmas = config.max_bias_sigmas}),
      events_(events) {
  const auto add = [&](const std::string& name, const std::string& what, double rate_hz,
                       double gap_periods) {
    streams_[name];
    const RateLimits limits{.tolerance = config.rate_tolerance,
                            .missing_share = config.missing_share,
                            .pause_periods = gap_periods};
    paces_.insert({name, Pace{.rate = RateWatch(rate_hz, limits),
                              .period = 1.0 / rate_hz,
                              .gap_periods = gap_periods,
                              .gap_key = "supervisor." + name + "_gap_periods",
                              .what = what,
                              .rate_key = name + ".rate_hz"}});
  };
  add("imu", "samples", rig.imu.rate_hz, config.imu_gap_periods);
  if (rig.lidar) add("lidar", "sweeps", rig.lidar->rate_hz, config.lidar_gap_periods);
}

void Supervisor::Observe(const ImuSample& sample) {
  StreamReport& report = streams_["imu"];
  ++report.received;
  ++report.used;
  imu_.Observe(sample);
  ObservePace("imu", paces_.at("imu"), sample.stamp,
              "motion is held over the gap with grown uncertainty");
  AnnounceImu(sample.stamp);
}

// What makes every estimate worthless is said early, not after an hour.
void Supervisor::AnnounceImu(Time now) {
  if (imu_announced_ || streams_["imu"].used < kEarlySamples) return;
  imu_announced_ = true;
  for (const Health& finding : imu_.Findings()) {
    if (finding.level != HealthLevel::kFailed) continue;
    events_.Raise({.stamp = now,
                   .severity = Severity::kError,
                   .source = "imu",
                   .message = finding.reason + "."});
  }
}

void Supervisor::Observe(const LidarSweep& sweep, const LioResult& result,
                         std::span<const ImuSample> imu) {
  StreamReport& report = streams_["lidar"];
  ++report.received;
  ObservePace("lidar", paces_.at("lidar"), sweep.end(),
              "the IMU alone carries the estimate over the gap");
  mount_.Observe(result, imu);
  if (result.status == LioResult::Status::kRejected) {
    if (report.dropped[result.rejection]++ == 0) {
      events_.Raise({.stamp = sweep.stamp,
                     .severity = Severity::kWarning,
                     .source = "lidar",
                     .message = "sweep not used: " + result.reason +
                                ". Further ones are counted in the summary."});
    }
  } else if (result.status == LioResult::Status::kTracking) {
    report.used += static_cast<std::int64_t>(result.estimates.size());
  } else {
    ++pending_sweeps_;
    odometry_.waiting_for = result.reason;
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
    failures_in_a_row_ = 0;
    DeclareLost(
        sweep.stamp, fmt::format("track lost at {}: {}", ToString(sweep.stamp), result.reason),
        "What was estimated before is kept. If the recording was interrupted here, evaluate "
        "its parts one by one; else see whether LiDAR and IMU deliver (gaps in the "
        "summary), or raise lio.lost_after.");
  }
  if (odometry_.resets.empty() || odometry_.resets.back().resumed.valid()) return;
  ResetReport& reset = odometry_.resets.back();
  ++reset.sweeps_without_pose;
  if (result.status != LioResult::Status::kTracking) return;
  reset.resumed = result.estimates.front().state.stamp;
  reset.sweeps_without_pose -= static_cast<std::int64_t>(result.estimates.size());
  odometry_.lost = false;
  odometry_.lost_reason.clear();
  events_.Raise({.stamp = reset.resumed,
                 .severity = Severity::kInfo,
                 .source = "lio",
                 .message = fmt::format("track found again at {} ({})", ToString(reset.resumed),
                                        result.reason)});
}

void Supervisor::ObserveFailures(const LidarSweep& sweep, const LioResult& result) {
  if (result.status == LioResult::Status::kInitializing) return;  // a new start takes its time
  const bool registered =
      result.status == LioResult::Status::kTracking && (result.converged || result.gap);
  failures_in_a_row_ = registered ? 0 : failures_in_a_row_ + 1;
  if (failures_in_a_row_ != config_.lost_after_sweeps) return;
  DeclareLost(sweep.stamp,
              fmt::format("{} sweeps in a row before {} without a valid registration (last: {} "
                          "correspondences{}{})",
                          config_.lost_after_sweeps, ToString(sweep.stamp), result.correspondences,
                          result.reason.empty() ? "" : ", ", result.reason),
              "Likely wrong extrinsics, a LiDAR that sees too little, or motion beyond the IMU's "
              "range; the poses from there on are not to be trusted.");
}

void Supervisor::DeclareLost(Time stamp, const std::string& reason, const std::string& advice) {
  odometry_.lost = true;
  odometry_.lost_reason = reason;
  events_.Raise({.stamp = stamp,
                 .severity = Severity::kError,
                 .source = "lio",
                 .message = reason + ". " + advice});
}

void Supervisor::ObservePace(const std::string& name, Pace& pace, Time now,
                             const std::string& remedy) {
  if (pace.newest.valid() && now > pace.newest) {
    ObserveGap(name, pace, now, remedy);
    pace.rate.Add(now - pace.newest);
  }
  pace.newest = now;
  if (pace.announced || pace.rate.intervals() < kEarlyIntervals) return;
  pace.announced = true;
  if (const std::string finding = pace.rate.Finding(pace.what, pace.rate_key); !finding.empty()) {
    events_.Raise(
        {.stamp = now, .severity = Severity::kWarning, .source = name, .message = finding + "."});
  }
}

void Supervisor::ObserveGap(const std::string& name, const Pace& pace, Time now,
                            const std::string& remedy) {
  const double gap = (now - pace.newest).seconds();
  const double limit = pace.gap_periods * pace.period;
  if (gap <= limit) return;
  StreamReport& report = streams_[name];
  report.longest_gap = std::max(report.longest_gap, gap);
  if (report.gaps++ == 0) {
    events_.Raise(
        {.stamp = now,
         .severity = Severity::kWarning,
         .source = name,
         .message = fmt::format(
             "gap of {:.3f} s before {} (nominal {:.4g} s; a gap from {:.4g} s on, {}): {}. "
             "Further gaps, and what was dropped, are counted in the summary.",
             gap, ToString(now), pace.period, limit, pace.gap_key, remedy)});
  }
}

void Supervisor::AddDropped(const DropCounts& dropped) {
  for (const auto& [name, reasons] : dropped) {
    if (!streams_.contains(name)) continue;  // a camera: CameraWatch takes it over
    for (const auto& [reason, count] : reasons) {
      streams_[name].dropped[reason] += count;
      streams_[name].received += count;
    }
  }
}

Health Supervisor::Judge(const std::string& name, const StreamReport& report) const {
  const Pace& pace = paces_.at(name);
  const std::int64_t lost = DroppedTotal(report);
  if (report.received == 0) return {HealthLevel::kFailed, fmt::format("no {} arrived", pace.what)};
  if (report.used == 0) {
    return {HealthLevel::kFailed,
            "none used" + (lost > 0 ? ": " + DroppedText(report, pace.what) : "")};
  }
  Health health;
  const bool back = report.dropped.contains(kStampGoesBack);
  if (back) {
    Worsen(health, {HealthLevel::kDegraded,
                    fmt::format("time jumped back, {} {} dropped until it was passed",
                                report.dropped.at(kStampGoesBack), pace.what)});
  }
  // A few dropped ones do no harm, but where there are gaps they are the likely cause.
  if (SuffersFromDrops(report, config_.degraded_share) || (lost > 0 && report.gaps > 0 && !back)) {
    Worsen(health, {HealthLevel::kDegraded, DroppedText(report, pace.what)});
  }
  if (report.gaps > 0) {
    Worsen(health, {HealthLevel::kDegraded,
                    fmt::format("{} gaps, the longest {:.3f} s", report.gaps, report.longest_gap)});
  }
  if (const std::string finding = pace.rate.Finding(pace.what, pace.rate_key); !finding.empty()) {
    Worsen(health, {HealthLevel::kDegraded, finding});
  }
  return health;
}

void Supervisor::Conclude() {
  for (auto& [name, report] : streams_) {
    report.health = Judge(name, report);
    report.rate_hz = paces_.at(name).rate.Measured();
  }
  for (const Health& finding : imu_.Findings()) Worsen(streams_["imu"].health, finding);
  for (const std::string& finding : mount_.Findings())
    Worsen(odometry_.health, {HealthLevel::kDegraded, finding});
  if (odometry_.translation_degenerate > 0) {
    odometry_.mean_weak_translation_axis /= static_cast<double>(odometry_.translation_degenerate);
  }
}

}  // namespace mlvi

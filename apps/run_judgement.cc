// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "run_judgement.h"

#include <fmt/format.h>

#include "exit_code.h"

namespace {

using namespace mlvi;

// Adds a finding to a list that is read by people.
void Append(std::string& list, const std::string& finding) {
  if (!finding.empty()) list += (list.empty() ? "" : "; ") + finding;
}

// What is wrong with the streams and with the agreement of the sensors.
std::string Complaints(const Slam& slam) {
  std::string list;
  for (const auto& [name, report] : slam.Streams()) {
    if (report.health.level != HealthLevel::kHealthy)
      Append(list, fmt::format("{}: {}", name, report.health.reason));
  }
  if (const Health& odometry = slam.supervisor().odometry().health;
      odometry.level != HealthLevel::kHealthy) {
    Append(list, "odometry: " + odometry.reason);
  }
  return list;
}

std::string NoStart(const Slam& slam, const std::string& waiting_for) {
  std::string reason = waiting_for;
  Append(reason, Complaints(slam));
  if (reason.empty()) reason = "too little was recorded for a start";
  return "no first state was found: " + reason;
}

// Why there is no estimate to rely on; empty when there is one.
std::string Failure(const Slam& slam, const Rig& rig) {
  const Health& imu = slam.supervisor().streams().at("imu").health;
  const OdometryReport& lidar = slam.supervisor().odometry();
  if (rig.lidar && !lidar.initialized) return NoStart(slam, lidar.waiting_for);
  if (rig.lidar && lidar.lost) return lidar.lost_reason;
  if (!rig.lidar) {
    const VisualReport& visual = slam.visual()->report();
    if (!visual.first_estimate.valid()) return NoStart(slam, visual.waiting_for);
    if (!visual.tracking)
      return "visual odometry was lost and not found again: " + visual.last_failure;
  }
  return imu.level == HealthLevel::kFailed ? "imu: " + imu.reason : "";
}

// Whether a failure is one of the recording: no IMU to speak of, or fewer than two sweeps or
// images.
bool LacksInput(const Slam& slam, const Rig& rig) {
  const auto streams = slam.Streams();
  if (streams.at("imu").health.level == HealthLevel::kFailed) return true;
  std::int64_t received = 0, used = 0;
  for (const auto& [name, report] : streams) {
    if (name == "imu" || (rig.lidar && name != "lidar")) continue;
    received += report.received;
    used += report.used;
  }
  return rig.lidar ? used == 0 && received < 2 : received < 2;
}

RunStatus StatusOf(RosBagSource::Ending ending) {
  switch (ending) {
    case RosBagSource::Ending::kTruncated: return RunStatus::kInputTruncated;
    case RosBagSource::Ending::kDamaged: return RunStatus::kInputDamaged;
    case RosBagSource::Ending::kUnusable:
    case RosBagSource::Ending::kWhole: return RunStatus::kInputUnusable;
  }
  return RunStatus::kInputUnusable;
}

std::string Resets(const Slam& slam) {
  const auto& resets = slam.supervisor().odometry().resets;
  if (resets.empty()) return {};
  return fmt::format("odometry: {} resets, the first: {}", resets.size(), resets.front().reason);
}

}  // namespace

std::string ToString(RunStatus status) {
  switch (status) {
    case RunStatus::kOk: return "ok";
    case RunStatus::kDegraded: return "degraded";
    case RunStatus::kInterrupted: return "interrupted";
    case RunStatus::kInputUnusable: return "input_unusable";
    case RunStatus::kInputTruncated: return "input_truncated";
    case RunStatus::kInputDamaged: return "input_damaged";
    case RunStatus::kFailed: return "failed";
  }
  return "failed";
}

Verdict Judge(const Slam& slam, const Rig& rig, const RosBagSource& source, bool interrupted,
              const std::optional<Error>& input_error) {
  if (interrupted) {
    return {RunStatus::kInterrupted,
            "interrupted by a signal; what was estimated until then is kept", kExitInterrupted};
  }
  if (input_error) return {StatusOf(source.ending()), input_error->message, kExitInput};
  if (const std::string failure = Failure(slam, rig); !failure.empty()) {
    return {RunStatus::kFailed, failure, LacksInput(slam, rig) ? kExitInput : kExitEstimation};
  }
  std::string reasons = Resets(slam);
  Append(reasons, Complaints(slam));
  if (reasons.empty()) return {};
  return {RunStatus::kDegraded, reasons, kExitDone};
}

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "summary.h"

#include <sys/resource.h>

#include <numbers>

namespace {

using nlohmann::ordered_json;

double CpuSeconds(const rusage& usage) {
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::string LevelName(mlvi::HealthLevel level) {
  switch (level) {
    case mlvi::HealthLevel::kHealthy: return "healthy";
    case mlvi::HealthLevel::kDegraded: return "degraded";
    case mlvi::HealthLevel::kFailed: return "failed";
  }
  return "unknown";
}

ordered_json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json Messages(const std::map<std::string, mlvi::StreamCounts>& read) {
  ordered_json topics = ordered_json::object();
  for (const auto& [topic, counts] : read) {
    topics[topic] = {{"in", counts.messages},
                     {"used", counts.delivered},
                     {"thinned", counts.thinned},
                     {"dropped", counts.dropped},
                     {"repaired", counts.repaired}};
  }
  return topics;
}

ordered_json Streams(const std::map<std::string, mlvi::StreamReport>& reports) {
  ordered_json streams = ordered_json::object();
  for (const auto& [name, report] : reports) {
    streams[name] = {{"in", report.received},
                     {"used", report.used},
                     {"dropped", report.dropped},
                     {"gaps", report.gaps},
                     {"longest_gap_s", report.longest_gap},
                     {"rate_hz", report.rate_hz ? ordered_json(*report.rate_hz) : ordered_json()},
                     {"health", LevelName(report.health.level)},
                     {"reason", report.health.reason}};
  }
  return streams;
}

ordered_json Resets(const std::vector<mlvi::ResetReport>& resets) {
  ordered_json list = ordered_json::array();
  for (const mlvi::ResetReport& reset : resets) {
    list.push_back({{"lost_s", mlvi::ToString(reset.lost)},
                    {"resumed_s", reset.resumed.valid() ? mlvi::ToString(reset.resumed) : ""},
                    {"sweeps_without_pose", reset.sweeps_without_pose},
                    {"reason", reset.reason}});
  }
  return list;
}

ordered_json Odometry(const mlvi::Slam& slam) {
  const mlvi::OdometryReport& report = slam.supervisor().odometry();
  ordered_json odometry = {
      {"initialized", report.initialized},
      {"first_estimate_s", report.initialized ? mlvi::ToString(report.first_estimate) : ""},
      {"estimates", slam.odometry().size()},
      {"sweeps_before_start", report.sweeps_before_start},
      {"sweeps_unconverged", report.sweeps_unconverged},
      {"sweeps_degenerate", report.sweeps_degenerate},
      {"sweeps_degenerate_in_translation", report.translation_degenerate},
      {"sweeps_degenerate_in_rotation", report.rotation_degenerate},
      {"mean_weak_translation_axis_world", Vector(report.mean_weak_translation_axis)},
      {"resets", Resets(report.resets)},
      {"lost", report.lost},
      {"lost_reason", report.lost_reason},
      {"waiting_for", report.initialized ? "" : report.waiting_for},
      {"health", LevelName(report.health.level)},
      {"reason", report.health.reason},
      {"lidar_time_offset", nullptr},
      {"final_bias", nullptr}};
  if (const mlvi::TimeOffset& offset = slam.lidar_time_offset(); offset.sigma > 0.0) {
    odometry["lidar_time_offset"] = {{"deviation_s", offset.seconds}, {"sigma_s", offset.sigma}};
  }
  if (slam.newest()) {
    const mlvi::NavState& state = slam.newest()->state;
    odometry["final_bias"] = {{"accelerometer_m_s2", Vector(state.bias.accelerometer)},
                              {"gyroscope_rad_s", Vector(state.bias.gyroscope)}};
  }
  return odometry;
}

// Of a camera's estimated place from what the rig file says.
ordered_json Deviation(const mlvi::CalibrationDeviation& deviation, std::size_t camera) {
  if (camera >= deviation.cameras.size()) return nullptr;
  const mlvi::CalibrationDeviation::Camera& d = deviation.cameras[camera];
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  return {{"rotation_deg", kDegrees * d.rotation},
          {"rotation_sigma_deg", kDegrees * d.rotation_sigma},
          {"translation_m", d.translation},
          {"translation_sigma_m", d.translation_sigma}};
}

// Of a camera's time offset from what the rig file says.
ordered_json TimeOffset(const mlvi::CalibrationDeviation& deviation, std::size_t camera) {
  if (camera >= deviation.time_offsets.size()) return nullptr;
  const mlvi::CalibrationDeviation::TimeOffset& d = deviation.time_offsets[camera];
  return {{"deviation_s", d.seconds}, {"sigma_s", d.sigma}};
}

// The visual odometry: its own figures and, per camera, how much it gives and how well it fits.
ordered_json Visual(const mlvi::Slam& slam) {
  if (slam.visual() == nullptr) return nullptr;
  const mlvi::VisualReport& report = slam.visual()->report();
  const mlvi::CameraFit& fit = slam.visual()->fit();
  ordered_json cameras = ordered_json::object();
  for (std::size_t i = 0; i < fit.names().size(); ++i) {
    const mlvi::CameraFit::Figures& figures = fit.figures()[i];
    cameras[fit.names()[i]] = {{"mean_tracks", fit.sets() > 0 ? static_cast<double>(figures.alive) /
                                                                    static_cast<double>(fit.sets())
                                                              : 0.0},
                               {"rms_px", figures.rms_px()},
                               {"rejected_share", figures.rejected_share()},
                               {"deviation", Deviation(fit.deviation(), i)},
                               {"time_offset", TimeOffset(fit.deviation(), i)}};
  }
  return {{"image_sets", report.sets},
          {"image_sets_tracking", report.sets_tracking},
          {"first_estimate_s",
           report.first_estimate.valid() ? mlvi::ToString(report.first_estimate) : ""},
          {"failures", report.failures},
          {"last_failure", report.last_failure},
          {"cameras", cameras}};
}

ordered_json Stages(const mlvi::StageTimes& times) {
  ordered_json stages = ordered_json::object();
  for (const auto& [name, s] : times.Summarize()) {
    stages[name] = {{"count", s.count}, {"mean", s.mean_ms}, {"p50", s.p50_ms},
                    {"p95", s.p95_ms},  {"p99", s.p99_ms},   {"max", s.max_ms}};
  }
  return stages;
}

ordered_json Events(const std::vector<mlvi::Event>& events) {
  ordered_json list = ordered_json::array();
  for (const mlvi::Event& event : events) {
    const char* severity = event.severity == mlvi::Severity::kError     ? "error"
                           : event.severity == mlvi::Severity::kWarning ? "warning"
                                                                        : "info";
    list.push_back({{"stamp", mlvi::ToString(event.stamp)},
                    {"severity", severity},
                    {"source", event.source},
                    {"message", event.message}});
  }
  return list;
}

ordered_json Pose(const mlvi::Pose3& pose) {
  const auto& q = pose.rotation();
  return {{"t", Vector(pose.translation())}, {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

// How the sensors stand to one another at the end: as the rig says, unless estimated.
ordered_json Calibration(const mlvi::Rig& rig, const mlvi::WindowConfig& window) {
  ordered_json calibration = {{"imu", {{"time_offset_s", rig.imu.time_offset.seconds()}}},
                              {"lidar", nullptr}};
  if (rig.lidar) {
    calibration["lidar"] = {{"T_body_lidar", Pose(rig.lidar->T_body_lidar)},
                            {"time_offset_s", rig.lidar->time_offset.seconds()}};
  }
  calibration["cameras"] = ordered_json::object();
  for (const mlvi::CameraSpec& camera : rig.cameras) {
    calibration["cameras"][camera.name] = {
        {"T_body_camera", Pose(camera.T_body_camera)},
        {"extrinsics_estimated", window.extrinsics != mlvi::ExtrinsicsCalibration::kOff},
        {"time_offset_s", camera.time_offset.seconds()},
        {"time_offset_estimated", window.time_offset}};
  }
  return calibration;
}

}  // namespace

ordered_json MakeSummary(const RunFacts& facts, const mlvi::Slam& slam, const mlvi::Rig& rig,
                         const mlvi::WindowConfig& window) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {{"status", ToString(facts.verdict.status)},
          {"reason", facts.verdict.reason},
          {"bags", facts.bags},
          {"rig", facts.rig},
          {"data_duration_s", facts.data_duration_s},
          {"wall_s", facts.wall_s},
          {"cpu_s", CpuSeconds(usage)},
          {"real_time_factor", facts.wall_s > 0.0 ? facts.data_duration_s / facts.wall_s : 0.0},
          {"peak_rss_mb", static_cast<double>(usage.ru_maxrss) / 1024.0},
          {"keyframes", slam.graph().keyframes().size()},
          {"graph_converged", slam.graph().converged()},
          {"resets", slam.supervisor().odometry().resets.size()},
          {"loops", slam.graph().loops()},
          {"messages", Messages(facts.read)},
          {"streams", Streams(slam.Streams())},
          {"odometry", Odometry(slam)},
          {"visual", Visual(slam)},
          {"stages_ms", Stages(slam.times())},
          {"calibration", Calibration(rig, window)},
          {"notes", facts.notes},
          {"not_written", ordered_json::array()},  // known once the other files are written
          {"events", Events(facts.events)}};
}

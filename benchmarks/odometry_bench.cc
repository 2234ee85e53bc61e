// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Accuracy, consistency, speed and memory of the whole odometry on simulated sequences with exact
// truth:
//   odometry_bench --sequence courtyard-hard --rig newer_college --seconds 60 --seeds 1 --set lio.variant=edge_plane
// Prints one line per seed and, for several seeds, means and the NEES of the pose.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench_setup.h"
#include "mlvi/base/parallel.h"
#include "mlvi/eval/evaluation.h"
#include "mlvi/eval/nees.h"
#include "mlvi/pipeline/slam.h"
#include "mlvi/sim/recording.h"

namespace {

using namespace mlvi;

struct Options : BenchSetup {
  int first_seed = 1;
  int seeds = 1;
  bool json = false, exact_clocks = false;
};

// One run's figures.
struct Outcome {
  std::uint64_t seed = 0;
  double odometry_ate = NAN, trajectory_ate = NAN;  // m, se3-aligned rmse
  double attitude_rmse_deg = 0.0, attitude_max_deg = 0.0;
  double drift_percent = NAN;  // mean of errors of segments per length, of the odometry
  // Once per second: of the pose, of its position and its rotation alone (three degrees of freedom
  // each).
  std::vector<double> nees, nees_position, nees_rotation;
  // The same of every keyframe when it was the newest of the graph.
  std::vector<double> graph_nees, graph_nees_position, graph_nees_rotation;
  double sweep_p50_ms = 0.0, sweep_p99_ms = 0.0;
  std::int64_t sweeps = 0, used = 0, degenerate = 0, resets = 0;
  Eigen::Vector3d weak_axis = Eigen::Vector3d::Zero();
  std::size_t keyframes = 0;
  TimeOffset lidar_time_offset;
  double rss_begin_mb = 0.0, rss_end_mb = 0.0;
};

double ResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0.0, resident = 0.0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
}

// The estimator's world has its origin and yaw at its first pose; roll and pitch it must know.
Pose3 YawAndPositionAlignment(const Pose3& T_world_body, const Pose3& T_truth_body) {
  const Eigen::Matrix3d R = T_world_body.R() * T_truth_body.R().transpose();
  const double yaw = std::atan2(R(1, 0) - R(0, 1), R(0, 0) + R(1, 1));
  const Eigen::Quaterniond rotation = ExpSo3({0.0, 0.0, yaw});
  return Pose3(rotation, T_world_body.translation() - rotation * T_truth_body.translation());
}

// Estimates belong to ends of sweeps: the truth at the instant at which the LiDAR's clock showed
// `stamp`.
Pose3 TruthOf(const Recording& recording, Time stamp) {
  return recording.GroundTruth(stamp, "lidar").T_world_body;
}

class NeesCollector {
 public:
  // Takes states at least `period` seconds apart. `origin` is where the world was defined.
  NeesCollector(const Recording& recording, const StampedPose& origin, double period)
      : recording_(recording),
        period_(period),
        T_world_truth_(YawAndPositionAlignment(origin.pose, TruthOf(recording, origin.stamp))),
        last_(origin.stamp) {}

  void Observe(const NavState& state, const Matrix15d& state_covariance) {
    if (state.stamp == last_ || (state.stamp - last_).seconds() < period_) return;
    last_ = state.stamp;
    const Pose3& T_world_body = state.T_world_body;
    const Pose3 T_world_truth = T_world_truth_ * TruthOf(recording_, state.stamp);
    const Matrix6d covariance = PoseChartCovariance(T_world_body.R(), state_covariance);
    const auto nees = PoseNees(T_world_body, T_world_truth, covariance);
    if (!nees) return;
    pose_.push_back(*nees);
    const Vector6d error = BoxMinus(T_world_truth, T_world_body);
    const auto part = [&](int offset) {
      const Eigen::Vector3d e = error.segment<3>(offset);
      return e.dot(covariance.block<3, 3>(offset, offset).inverse() * e);
    };
    position_.push_back(part(0));
    rotation_.push_back(part(3));
  }
  const std::vector<double>& pose() const { return pose_; }
  const std::vector<double>& position() const { return position_; }
  const std::vector<double>& rotation() const { return rotation_; }

 private:
  const Recording& recording_;
  double period_;
  Pose3 T_world_truth_;
  Time last_;
  std::vector<double> pose_, position_, rotation_;
};

Trajectory TruthAt(const Recording& recording, const Trajectory& estimate) {
  Trajectory truth;
  for (const StampedPose& pose : estimate) {
    truth.push_back({.stamp = pose.stamp, .pose = TruthOf(recording, pose.stamp)});
  }
  return truth;
}

void Evaluate(const Recording& recording, const Slam& slam, Outcome& outcome) {
  const Trajectory truth = TruthAt(recording, slam.odometry());
  const auto odometry = mlvi::Evaluate(slam.odometry(), truth, {});
  const auto smoothed = mlvi::Evaluate(slam.SmoothedTrajectory(), truth, {});
  constexpr double kDegrees = 180.0 / 3.14159265358979323846;
  if (!odometry || !smoothed) return;
  outcome.odometry_ate = odometry->absolute_translation.rmse;
  outcome.trajectory_ate = smoothed->absolute_translation.rmse;
  double drift = 0.0;
  for (const SegmentDrift& segment : odometry->drift) drift += segment.translation_percent;
  if (!odometry->drift.empty())
    outcome.drift_percent = drift / static_cast<double>(odometry->drift.size());
  if (odometry->absolute_rotation) {
    outcome.attitude_rmse_deg = odometry->absolute_rotation->rmse * kDegrees;
    outcome.attitude_max_deg = odometry->absolute_rotation->max * kDegrees;
  }
}

Outcome RunOnce(const Options& options, const Rig& rig, const SlamConfig& config,
                std::uint64_t seed) {
  SequenceOptions sequence = StandardSequence(options.sequence, rig, options.seconds, seed);
  sequence.rest = options.rest;
  if (options.exact_clocks) sequence.clocks = {};
  Recording recording(sequence);
  Rig used = recording.rig();
  used.cameras.clear();
  Slam slam(config, used);
  std::optional<NeesCollector> nees, graph_nees;
  Outcome outcome;
  outcome.seed = seed;
  outcome.rss_begin_mb = ResidentMegabytes();
  slam.events().Subscribe(
      [](const Event& event) { fmt::print(stderr, "{}: {}\n", event.source, event.message); });
  Time newest;
  while (true) {
    const auto next = recording.Next();
    if (!next || !*next) break;
    slam.Process(**next);
    if (!slam.newest() || slam.newest()->state.stamp == newest) continue;
    newest = slam.newest()->state.stamp;
    if (!nees) {
      const StampedPose& origin = slam.odometry().back();  // what defines the map's world
      nees.emplace(recording, origin, 1.0);
      graph_nees.emplace(recording, origin, 0.0);
    }
    nees->Observe(slam.newest()->state, slam.newest()->covariance);
    const std::optional<GraphUpdate>& smoothed = slam.graph().newest();
    if (smoothed && smoothed->newest.stamp == newest)
      graph_nees->Observe(smoothed->newest, smoothed->covariance);
  }
  slam.Finish();
  outcome.rss_end_mb = ResidentMegabytes();
  if (nees) {
    outcome.nees = nees->pose();
    outcome.nees_position = nees->position();
    outcome.nees_rotation = nees->rotation();
    outcome.graph_nees = graph_nees->pose();
    outcome.graph_nees_position = graph_nees->position();
    outcome.graph_nees_rotation = graph_nees->rotation();
  }
  const auto stages = slam.times().Summarize();
  outcome.sweep_p50_ms = stages.at("sweep").p50_ms;
  outcome.sweep_p99_ms = stages.at("sweep").p99_ms;
  const StreamReport& lidar = slam.supervisor().streams().at("lidar");
  outcome.sweeps = lidar.received;
  outcome.used = lidar.used;
  outcome.degenerate = slam.supervisor().odometry().sweeps_degenerate;
  outcome.weak_axis = slam.supervisor().odometry().mean_weak_translation_axis;
  outcome.resets = static_cast<std::int64_t>(slam.supervisor().odometry().resets.size());
  outcome.keyframes = slam.graph().keyframes().size();
  outcome.lidar_time_offset = slam.lidar_time_offset();
  Evaluate(recording, slam, outcome);
  return outcome;
}

double Mean(const std::vector<double>& nees) {
  return nees.empty() ? NAN : SummarizeNees(nees, 6).mean;
}

nlohmann::ordered_json ToJson(const Options& options, const Outcome& o) {
  return {{"sequence", options.sequence},
          {"rig", options.rig},
          {"seed", o.seed},
          {"settings", options.assignments},
          {"exact_clocks", options.exact_clocks},
          {"odometry_ate_m", o.odometry_ate},
          {"trajectory_ate_m", o.trajectory_ate},
          {"attitude_rmse_deg", o.attitude_rmse_deg},
          {"attitude_max_deg", o.attitude_max_deg},
          {"drift_percent", o.drift_percent},
          {"mean_nees", Mean(o.nees)},
          {"nees_count", o.nees.size()},
          {"mean_graph_nees", Mean(o.graph_nees)},
          {"graph_nees_count", o.graph_nees.size()},
          {"sweep_p50_ms", o.sweep_p50_ms},
          {"sweep_p99_ms", o.sweep_p99_ms},
          {"sweeps", o.sweeps},
          {"used", o.used},
          {"degenerate", o.degenerate},
          {"weak_axis", {o.weak_axis.x(), o.weak_axis.y(), o.weak_axis.z()}},
          {"resets", o.resets},
          {"keyframes", o.keyframes},
          {"lidar_time_offset_s", o.lidar_time_offset.seconds},
          {"lidar_time_offset_sigma_s", o.lidar_time_offset.sigma},
          {"rss_begin_mb", o.rss_begin_mb},
          {"rss_end_mb", o.rss_end_mb}};
}

void Print(const Options& options, const Outcome& o) {
  if (options.json) {
    fmt::print("{}\n", ToJson(options, o).dump());
    std::fflush(stdout);
    return;
  }
  fmt::print(
      "{:16} {:14} seed {:2}  ATE {:.4f} m (smoothed {:.4f})  attitude {:.3f} deg (max {:.3f})  "
      "NEES {:6.2f} (graph {:.2f})  used "
      "{}/{}  degenerate {} ({:.2f} {:.2f} {:.2f})  LiDAR's clock {:.2f} +- {:.2f} ms  sweep p50 "
      "{:.1f} p99 {:.1f} ms  {} keyframes  "
      "RSS {:.0f} -> {:.0f} MB\n",
      options.sequence, options.rig, o.seed, o.odometry_ate, o.trajectory_ate, o.attitude_rmse_deg,
      o.attitude_max_deg, Mean(o.nees), Mean(o.graph_nees), o.used, o.sweeps, o.degenerate,
      o.weak_axis.x(), o.weak_axis.y(), o.weak_axis.z(), o.lidar_time_offset.seconds * 1e3,
      o.lidar_time_offset.sigma * 1e3, o.sweep_p50_ms, o.sweep_p99_ms, o.keyframes, o.rss_begin_mb,
      o.rss_end_mb);
  std::fflush(stdout);
}

// The mean over seeds of a NEES at each second is made of independent values: its band is the test.
void PrintNeesOverSeeds(const std::vector<Outcome>& outcomes, const char* what,
                        std::vector<double> Outcome::*nees, int dof) {
  std::size_t seconds = (outcomes.front().*nees).size();
  for (const Outcome& o : outcomes) seconds = std::min(seconds, (o.*nees).size());
  std::size_t inside = 0;
  std::vector<double> means;
  for (std::size_t k = 0; k < seconds; ++k) {
    std::vector<double> values;
    for (const Outcome& o : outcomes) values.push_back((o.*nees)[k]);
    const NeesSummary summary = SummarizeNees(values, dof);
    means.push_back(summary.mean);
    inside += summary.consistent() ? 1U : 0U;
  }
  const NeesSummary band = SummarizeNees(std::vector<double>(outcomes.size(), dof), dof);
  fmt::print(
      "NEES of the {} over {} seeds, 95 % band of the mean [{:.2f}, {:.2f}], expected {}: inside "
      "at {} of {} "
      "instants; means at those instants: {:.2f}\n",
      what, outcomes.size(), band.low, band.high, dof, inside, seconds, fmt::join(means, " "));
}

int Run(const Options& options) {
  SlamConfig config;
  const Expected<Rig> rig = Resolve(options, config);
  if (!rig) {
    fmt::print(stderr, "{}\n", rig.error().message);
    return 1;
  }
  const ThreadLimit threads(options.threads);
  std::vector<Outcome> outcomes;
  for (int i = 0; i < options.seeds; ++i) {
    outcomes.push_back(
        RunOnce(options, *rig, config, static_cast<std::uint64_t>(options.first_seed + i)));
    Print(options, outcomes.back());
  }
  if (options.seeds > 1 && !options.json) {
    PrintNeesOverSeeds(outcomes, "pose", &Outcome::nees, 6);
    PrintNeesOverSeeds(outcomes, "position", &Outcome::nees_position, 3);
    PrintNeesOverSeeds(outcomes, "rotation", &Outcome::nees_rotation, 3);
    PrintNeesOverSeeds(outcomes, "newest keyframe", &Outcome::graph_nees, 6);
    PrintNeesOverSeeds(outcomes, "newest keyframe's position", &Outcome::graph_nees_position, 3);
    PrintNeesOverSeeds(outcomes, "newest keyframe's rotation", &Outcome::graph_nees_rotation, 3);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.sequence = "courtyard-easy";
  CLI::App app("Odometry on simulated sequences: accuracy, consistency, speed, memory");
  AddSetupOptions(app, options);
  app.add_option("--first-seed", options.first_seed, "First seed");
  app.add_option("--seeds", options.seeds, "Number of seeds");
  app.add_flag("--exact-clocks", options.exact_clocks, "Stamps without the rig's errors");
  app.add_flag("--json", options.json, "One JSON object per run");
  CLI11_PARSE(app, argc, argv);
  return Run(options);
}

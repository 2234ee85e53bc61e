// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Accuracy, consistency and speed of visual-inertial odometry on simulated sequences with exact
// truth:
//   vio_bench --sequence quad-easy --seconds 40 --rate 15 --cache drawn
//   vio_bench --sequence quad-easy --seconds 40 --rate 15 --cache drawn --cameras cam0 --depth
//       --noise-seeds 1,2,3
// Prints one JSON object per seed of noise. Images and sweeps take long to draw: they are kept in
// the cache, and seeds of noise differ in the IMU's errors and those of the first state only.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "depth_accuracy.h"
#include "drawn_sequence.h"
#include "mlvi/base/parallel.h"
#include "mlvi/eval/evaluation.h"
#include "mlvi/eval/nees.h"
#include "mlvi/sim/recording.h"
#include "mlvi/vio/vio.h"
#include "track_accuracy.h"

namespace {

using namespace mlvi;

struct Options : DrawnSetup {
  double start_after = 0.0;
  bool depth = false, no_start = false, verbose = false, tracks = false;
  std::vector<std::string> cameras;
};

// What the odometry's sweep would be: deskewed by the truth to its last firing, every fourth point.
PointCloud Deskew(const LidarSweep& sweep, const Recording& recording, const Pose3& T_body_lidar) {
  const Pose3 T_end_world = recording.GroundTruth(sweep.end(), "lidar").T_world_body.inverse();
  std::vector<Eigen::Isometry3d> steps;  // per millisecond
  for (double ms = 0.0; ms <= sweep.span.seconds() * 1e3 + 1.0; ms += 1.0) {
    const Time t = std::min(sweep.stamp + Duration::FromSeconds(1e-3 * ms), sweep.end());
    const Pose3 T = T_end_world * recording.GroundTruth(t, "lidar").T_world_body * T_body_lidar;
    steps.emplace_back(T.matrix());
  }
  PointCloud points;
  for (std::size_t i = 0; i < sweep.points.size(); i += 4) {
    const LidarPoint& p = sweep.points[i];
    const auto step = static_cast<std::size_t>(p.offset_ns / 1'000'000);
    points.push_back((steps[step] * p.position.cast<double>()).cast<float>());
  }
  return points;
}

// Deskewed sweeps in one file: records of [stamp, points].
struct Cloud {
  Time stamp;
  PointCloud points;
};

std::string DrawClouds(const Options& o, const Rig& rig) {
  std::string path = CachePath(o, rig, "clouds");
  WriteOnce(path, [&](std::ostream& out) {
    Recording recording(MakeSequence(o, rig));
    while (true) {
      const auto next = recording.Next();
      if (!next || !*next) break;
      const auto* sweep = std::get_if<LidarSweep>(&**next);
      if (sweep == nullptr) continue;
      const PointCloud points = Deskew(*sweep, recording, recording.rig().lidar->T_body_lidar);
      const std::int64_t header[2] = {sweep->end().nanoseconds(),
                                      static_cast<std::int64_t>(points.size())};
      out.write(reinterpret_cast<const char*>(header), sizeof header);
      out.write(reinterpret_cast<const char*>(points.data()),
                static_cast<std::streamsize>(points.size() * sizeof points[0]));
    }
  });
  return path;
}

class CloudFile {
 public:
  explicit CloudFile(const std::string& path) : in_(path, std::ios::binary) {}
  std::optional<Cloud> Next() {
    std::int64_t header[2];
    if (!in_.read(reinterpret_cast<char*>(header), sizeof header)) return std::nullopt;
    Cloud cloud{.stamp = Time::FromNanoseconds(header[0]),
                .points = PointCloud(static_cast<std::size_t>(header[1]))};
    in_.read(reinterpret_cast<char*>(cloud.points.data()),
             static_cast<std::streamsize>(cloud.points.size() * sizeof cloud.points[0]));
    return in_ ? std::optional(std::move(cloud)) : std::nullopt;
  }

 private:
  std::ifstream in_;
};

struct Run {
  Trajectory estimate;
  std::vector<double> nees;  // of the pose, twice per second
  std::vector<double> tracks, features, with_lidar, iterations, rms;
  std::vector<std::vector<double>> camera_rms;
  int sets = 0, keyframes = 0, failures = 0;
  std::vector<std::string> reasons;
  double cpu_ms = 0.0;  // of Process, mean per set
};

double Mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

// Begins from the truth at first, and after every failure.
class Runner {
 public:
  Runner(const Options& options, const VioConfig& config, const Recording& recording,
         const ImuSimulator& imu, std::uint64_t noise_seed, const PanoramaModel& model, Vio& vio)
      : options_(options),
        recording_(recording),
        imu_(imu),
        noise_seed_(noise_seed),
        vio_(vio),
        accuracy_(recording, model),
        depth_accuracy_(recording, model, config.depth, config.window.pixel_sigma) {}

  void AddCloud(const Cloud& cloud) {
    const Pose3 T_world_body = recording_.GroundTruth(cloud.stamp, "lidar").T_world_body;
    vio_.AddDepthCloud(cloud.points, T_world_body, cloud.stamp);
    if (options_.tracks) depth_accuracy_.AddCloud(cloud.stamp, T_world_body, cloud.points);
  }

  void Process(const ImageSet& set, std::span<const ImuSample> imu) {
    if (set.stamp > recording_.end()) return;
    const bool may_start = !options_.no_start || run.failures > 0;
    if (may_start && !started_ &&
        (set.stamp - recording_.begin()).seconds() >= options_.start_after) {
      vio_.Start(NoisyTruth(Truth(set.stamp), noise_seed_));
      started_ = true;
    }
    const std::clock_t before = std::clock();
    const VioResult result = vio_.Process(set, imu);
    cpu_ += std::clock() - before;
    ++run.sets;
    run.cpu_ms = 1e3 * static_cast<double>(cpu_) / CLOCKS_PER_SEC / run.sets;
    if (options_.tracks) {
      const Time now = TrueTimeOf(recording_, set.stamp);
      accuracy_.Observe(now, vio_.tracks());
      depth_accuracy_.Observe(now, vio_.tracks());
    }
    Observe(set, result);
  }
  std::vector<TrackAccuracy::Row> TrackErrors() const { return accuracy_.Rows(); }
  std::vector<DepthAccuracy::Row> DepthErrors() const { return depth_accuracy_.Rows(); }
  Run run;

 private:
  NavState Truth(Time stamp) const {
    NavState truth = TruthOf(recording_, stamp);
    truth.bias = imu_.BiasAt(stamp);
    return truth;
  }

  void Observe(const ImageSet& set, const VioResult& result) {
    if (result.status == VioResult::Status::kFailed) {
      if (started_ || options_.no_start) {
        ++run.failures;
        run.reasons.push_back(result.reason);
      }
      started_ = false;
    }
    if (!result.estimate) return;
    const Pose3& pose = result.estimate->state.T_world_body;
    const Pose3 truth = TruthOf(recording_, set.stamp).T_world_body;
    run.estimate.push_back({.stamp = set.stamp, .pose = pose});
    run.keyframes += result.keyframe ? 1 : 0;
    const int alive = result.tracking.followed + result.tracking.started;
    run.tracks.push_back(alive);
    run.features.push_back(result.features);
    run.with_lidar.push_back(result.features_with_lidar);
    run.iterations.push_back(result.iterations);
    run.rms.push_back(result.rms_px);
    run.camera_rms.push_back(result.camera_rms_px);
    if (run.sets % static_cast<int>(0.5 * options_.rate) == 0) {
      const auto nees =
          PoseNees(pose, truth, PoseChartCovariance(pose.R(), result.estimate->covariance));
      if (nees) run.nees.push_back(*nees);
    }
    if (options_.verbose) {
      const Vector15d error = BoxMinus(Truth(set.stamp), result.estimate->state);
      fmt::print(
          stderr,
          "{:6.2f} p {:.3f} v {:.3f} R {:.4f} ba {:.3f} bg {:.4f}  sigma p {:.3f} | {} alive "
          "{} followed {} lost {} back {} outliers, {} features ({} lidar) {} it rms {:.2f} "
          "kf {}\n",
          (set.stamp - recording_.begin()).seconds(), error.segment<3>(0).norm(),
          error.segment<3>(3).norm(), error.segment<3>(6).norm(), error.segment<3>(9).norm(),
          error.segment<3>(12).norm(),
          std::sqrt(result.estimate->covariance.topLeftCorner<3, 3>().trace()), alive,
          result.tracking.followed, result.tracking.lost, result.tracking.round_trip,
          result.tracking.outliers, result.features, result.features_with_lidar, result.iterations,
          result.rms_px, result.keyframe);
    }
  }

  const Options& options_;
  const Recording& recording_;
  const ImuSimulator& imu_;
  std::uint64_t noise_seed_;
  Vio& vio_;
  TrackAccuracy accuracy_;
  DepthAccuracy depth_accuracy_;
  bool started_ = false;
  std::clock_t cpu_ = 0;
};

nlohmann::ordered_json Accuracy(const Run& run, const Recording& recording) {
  Trajectory truth;
  for (const StampedPose& pose : run.estimate) {
    truth.push_back({.stamp = pose.stamp, .pose = TruthOf(recording, pose.stamp).T_world_body});
  }
  const auto e = mlvi::Evaluate(run.estimate, truth, {});
  if (!e) return {{"error", e.error().message}};
  nlohmann::ordered_json drift;
  double mean = 0.0;
  for (const SegmentDrift& d : e->drift) {
    drift[fmt::format("{:.0f} m", d.length)] = d.translation_percent;
    mean += d.translation_percent / static_cast<double>(e->drift.size());
  }
  const Vector6d last = BoxMinus(run.estimate.back().pose, truth.back().pose);
  return {{"path_m", e->path_length},
          {"ate_m", e->absolute_translation.rmse},
          {"drift_percent", mean},
          {"drift_percent_by_length", drift},
          {"end_error_percent", 100.0 * last.head<3>().norm() / e->path_length},
          {"end_rotation_deg", last.tail<3>().norm() * 180.0 / M_PI}};
}

nlohmann::ordered_json ToJson(const Options& o, std::uint64_t noise_seed, const Run& run,
                              const Recording& recording, const StageTimes& times) {
  nlohmann::ordered_json j = {{"sequence", o.sequence},
                              {"rig", o.rig},
                              {"seed", o.seed},
                              {"noise_seed", noise_seed},
                              {"rate_hz", o.rate},
                              {"cameras", o.cameras},
                              {"depth", o.depth},
                              {"settings", o.assignments},
                              {"sets", run.sets},
                              {"estimates", run.estimate.size()},
                              {"keyframes", run.keyframes},
                              {"failures", run.failures},
                              {"reasons", run.reasons}};
  if (run.estimate.size() > 2) j.update(Accuracy(run, recording));
  j["mean_pose_nees"] = Mean(run.nees);
  j["tracks"] = Mean(run.tracks);
  j["features"] = Mean(run.features);
  j["features_with_lidar"] = Mean(run.with_lidar);
  j["iterations"] = Mean(run.iterations);
  j["rms_px"] = Mean(run.rms);
  if (!run.camera_rms.empty()) {
    for (std::size_t c = 0; c < run.camera_rms.back().size(); ++c) {
      std::vector<double> values;
      for (const auto& v : run.camera_rms) values.push_back(c < v.size() ? v[c] : 0.0);
      j["camera_rms_px"].push_back(Mean(values));
    }
  }
  j["cpu_ms_per_set"] = run.cpu_ms;
  for (const auto& [stage, s] : times.Summarize()) {
    j["stages_ms"][stage] = {{"mean", s.mean_ms}, {"p50", s.p50_ms}, {"p95", s.p95_ms}};
  }
  return j;
}

nlohmann::ordered_json ToJson(const std::vector<TrackAccuracy::Row>& rows) {
  nlohmann::ordered_json json;
  for (const TrackAccuracy::Row& row : rows) {
    json[row.kind] = {{"tracks", row.tracks},
                      {"share", row.share},
                      {"step_px", row.step},
                      {"step_beyond_1", row.step_1},
                      {"strict_step_beyond_1", row.strict_1},
                      {"median_px", row.median},
                      {"p90_px", row.p90},
                      {"beyond_1", row.beyond_1},
                      {"beyond_3", row.beyond_3},
                      {"whole_median_px", row.whole_median},
                      {"short_lived", row.short_lived},
                      {"young_beyond_1", row.beyond_1_young}};
  }
  return json;
}

nlohmann::ordered_json ToJson(const std::vector<DepthAccuracy::Row>& rows) {
  nlohmann::ordered_json json;
  for (const DepthAccuracy::Row& row : rows) {
    json[row.kind] = {{"asked", row.asked},           {"found", row.found},
                      {"median_m", row.median},       {"mean_relative", row.mean},
                      {"beyond_3_sigma", row.beyond}, {"mean_square_sigma", row.mean_square},
                      {"common_sigma", row.common},   {"too_far", row.too_far},
                      {"too_near", row.too_near}};
    if (row.kind == "all") json[row.kind]["search_ms"] = row.search_ms;
  }
  return json;
}

void RunOnce(const Options& options, const VioConfig& config, const Rig& used,
             const Recording& recording, std::uint64_t noise_seed, SetReader sets,
             std::optional<CloudFile> clouds) {
  const ImuSimulator imu = MakeImu(recording, noise_seed);
  StageTimes times;
  Vio vio(config, used, times);
  const auto model = PanoramaModel::FromRig(used);
  Runner runner(options, config, recording, imu, noise_seed, *model, vio);
  std::optional<Cloud> cloud = clouds ? clouds->Next() : std::nullopt;
  const auto add_clouds = [&](Time now) {
    for (; cloud && cloud->stamp <= now; cloud = clouds->Next()) {
      runner.AddCloud(*cloud);
    }
  };
  PlaySets(imu, std::move(sets), add_clouds,
           [&](const ImageSet& set, const auto& samples) { runner.Process(set, samples); });
  nlohmann::ordered_json json = ToJson(options, noise_seed, runner.run, recording, times);
  if (options.tracks) {
    json["track_errors"] = ToJson(runner.TrackErrors());
    json["depth_errors"] = ToJson(runner.DepthErrors());
  }
  fmt::print("{}\n", json.dump());
  std::fflush(stdout);  // a run takes minutes
}

int RunAll(const Options& options, const Rig& rig, const VioConfig& config) {
  const std::string images = DrawImages(options, rig);
  const std::string clouds = options.depth ? DrawClouds(options, rig) : "";
  const Recording recording(MakeSequence(options, rig));  // without images
  std::vector<int> new_index;
  const Rig used = SelectCameras(recording.rig(), options.cameras, new_index);
  if (used.cameras.empty()) {
    fmt::print(stderr, "none of the cameras {} is in the rig\n", options.cameras);
    return 1;
  }
  for (const std::uint64_t seed : options.noise_seeds) {
    RunOnce(options, config, used, recording, seed, SetReader(images, new_index),
            options.depth ? std::optional<CloudFile>(clouds) : std::nullopt);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.sequence = "quad-easy";
  options.seconds = 40.0;
  CLI::App app("Visual-inertial odometry on simulated sequences: accuracy, consistency, speed");
  AddDrawnOptions(app, options);
  app.add_option("--start-after", options.start_after, "Seconds until the start");
  app.add_option("--cameras", options.cameras, "Names; all without")->delimiter(',');
  app.add_flag("--depth", options.depth, "Depths from LiDAR");
  app.add_flag("--no-start", options.no_start, "No first state: cameras and IMU alone");
  app.add_flag("--tracks", options.tracks,
               "Errors of the tracks, too, and of depths: half as long again");
  app.add_flag("--verbose", options.verbose, "A line per set");
  CLI11_PARSE(app, argc, argv);
  mlvi::VioConfig config;
  const auto rig = Resolve(options, config);
  if (!rig) {
    fmt::print(stderr, "{}\n", rig.error().message);
    return 1;
  }
  const mlvi::ThreadLimit threads(options.threads);
  return RunAll(options, *rig, config);
}

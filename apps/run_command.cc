// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0

#include "run_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "exit_code.h"
#include "interrupt.h"
#include "mlvi/base/parallel.h"
#include "mlvi/base/progress.h"
#include "mlvi/io/config_file.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/pipeline/slam.h"
#include "run_outputs.h"
#include "sensor_selection.h"
#include "summary.h"

namespace {

using namespace mlvi;

struct RunOptions {
  std::vector<std::string> bags;
  std::string rig;
  std::string output;
  std::string config;
  std::vector<std::string> assignments;
  std::string cameras = "none";
  std::string compensation;  // empty: as configured
  bool no_lidar = false;
  bool no_loop = false;
  int threads = 0;
};

Expected<SlamConfig> ResolveConfig(const RunOptions& options) {
  SlamConfig config;
  ConfigDeclaration declaration = ConfigDeclaration::Of(config);
  if (!options.config.empty()) {
    if (const auto applied = ApplyConfigFile(options.config, declaration); !applied) {
      return tl::unexpected(applied.error());
    }
  }
  for (const std::string& assignment : options.assignments) {
    if (const auto set = declaration.SetAssignment(assignment); !set) return tl::unexpected(set.error());
  }
  if (!options.compensation.empty()) {
    const auto set = declaration.SetAssignment("vio.window.compensation=" + options.compensation);
    if (!set) return tl::unexpected(set.error());
  }
  if (const auto agree = declaration.Check(); !agree) return tl::unexpected(agree.error());
  return config;
}

// `all` takes what the recording holds; cameras asked for by name must be in it.
RosBagSourceOptions SourceOptions(const RunOptions& options, const SlamConfig& config, const Rig& rig) {
  return {.use_lidar = rig.lidar.has_value(),
          .cameras = rig.CameraNames(),
          .cameras_required = options.cameras != "all",
          .max_image_rate = config.visual.sets.max_rate,
          .image_tolerance = config.visual.sets.tolerance};
}

// The instants that the recording spans, as far as it was read.
class DataSpan {
 public:
  void Add(Time stamp) {
    first_ = first_.valid() ? std::min(first_, stamp) : stamp;
    last_ = std::max(last_, stamp);
  }
  double seconds() const { return first_.valid() ? (last_ - first_).seconds() : 0.0; }

 private:
  Time first_, last_;
};

// Feeds the recording to `slam`; returns why it ended early, if it did.
std::optional<Error> Feed(MeasurementSource& source, Slam& slam, const InterruptGuard& guard, DataSpan& span) {
  ProgressBar progress("run", stderr);
  while (!guard.interrupted()) {
    Expected<std::optional<Measurement>> next = source.Next();
    if (!next) return next.error();
    if (!*next) break;
    span.Add(AvailableAt(**next));
    slam.Process(**next);
    progress.Update(source.Progress(), fmt::format("{} poses", slam.odometry().size()));
  }
  if (!guard.interrupted()) progress.Finish();
  return std::nullopt;
}

// Images that could not be read are no concern of the estimator, but of the user.
std::string UnreadableImages(const RunFacts& facts, const Rig& rig) {
  std::string reasons;
  for (const CameraSpec& camera : rig.cameras) {
    const auto counts = facts.read.find(camera.topic);
    if (counts == facts.read.end() || counts->second.dropped.empty()) continue;
    std::int64_t dropped = 0;
    for (const auto& [reason, count] : counts->second.dropped) dropped += count;
    reasons += fmt::format("; {}: {} of {} images could not be read", camera.name, dropped, counts->second.messages);
  }
  return reasons;
}

// Why there is no estimate to rely on; empty when there is one.
std::string Failure(const Slam& slam, const Rig& rig) {
  const OdometryReport& lidar = slam.supervisor().odometry();
  if (rig.lidar && !lidar.initialized) return "no first state was found: see events";
  if (rig.lidar) return lidar.lost ? lidar.lost_reason : "";
  const VisualReport& visual = slam.visual()->report();
  if (!visual.first_estimate.valid()) return "no first state was found: " + visual.waiting_for;
  return visual.tracking ? "" : "visual odometry was lost and not found again: " + visual.last_failure;
}

void Judge(const Slam& slam, const Rig& rig, const InterruptGuard& guard, const std::optional<Error>& ended,
           RunFacts& facts) {
  const std::string failure = Failure(slam, rig);
  if (guard.interrupted()) {
    facts.status = "interrupted";
    facts.reason = "interrupted by a signal; what was estimated until then is kept";
  } else if (ended) {
    facts.status = "input_broken_off";
    facts.reason = ended->message;
  } else if (!failure.empty()) {
    facts.status = "failed";
    facts.reason = failure;
  } else {
    const auto& resets = slam.supervisor().odometry().resets;
    std::string reasons;
    if (!resets.empty()) {
      reasons = fmt::format("; odometry: {} resets, the first: {}", resets.size(), resets.front().reason);
    }
    reasons += UnreadableImages(facts, rig);
    for (const auto& [name, report] : slam.Streams()) {
      if (report.health.level != HealthLevel::kHealthy) reasons += fmt::format("; {}: {}", name, report.health.reason);
    }
    facts.status = reasons.empty() ? "ok" : "degraded";
    if (!reasons.empty()) facts.reason = reasons.substr(2);
  }
}

int ExitCode(const Slam& slam, const Rig& rig, const RunFacts& facts) {
  if (facts.status == "interrupted") return kExitInterrupted;
  if (facts.status == "input_broken_off") return kExitInput;
  if (facts.status != "failed") return kExitDone;
  const auto streams = slam.Streams();
  if (streams.at("imu").received == 0) return kExitInput;
  // Sweeps or images: without at least two there was nothing to estimate from.
  std::int64_t received = 0, used = 0;
  for (const auto& [name, report] : streams) {
    if (name == "imu" || (rig.lidar && name != "lidar")) continue;
    received += report.received;
    used += report.used;
  }
  const bool too_little = rig.lidar ? used == 0 && received < 2 : received < 2;
  return too_little ? kExitInput : kExitEstimation;
}

void PrintReport(const RunOptions& options, const Slam& slam, const RunFacts& facts) {
  const auto stages = slam.times().Summarize();
  fmt::print("status      {}{}{}\n", facts.status, facts.reason.empty() ? "" : ": ", facts.reason);
  fmt::print("poses       {} ({} keyframes, {} loops, {} resets)\n", slam.odometry().size(),
             slam.graph().keyframes().size(), slam.graph().loops(), slam.supervisor().odometry().resets.size());
  for (const auto& [stage, label] : {std::pair("sweep", "per sweep "), std::pair("image_set", "per images")}) {
    const auto times = stages.find(stage);
    if (times == stages.end()) continue;
    fmt::print("{}  p50 {:.1f} ms, p99 {:.1f} ms\n", label, times->second.p50_ms, times->second.p99_ms);
  }
  fmt::print("time        {:.1f} s of data in {:.1f} s\n", facts.data_duration_s, facts.wall_s);
  fmt::print("results     {}\n", options.output);
}

Expected<int> Run(const RunOptions& options) {
  const Expected<SlamConfig> config = ResolveConfig(options);
  if (!config) return tl::unexpected(config.error());
  const Expected<Rig> rig = LoadRig(options.rig).and_then(
      [&](const Rig& whole) { return SelectSensors(whole, options.cameras, options.no_lidar); });
  if (!rig) return tl::unexpected(rig.error());
  auto source = RosBagSource::Open(options.bags, *rig, SourceOptions(options, *config, *rig));
  if (!source) return tl::unexpected(source.error());
  const RunOutputs outputs(options.output);
  if (const auto prepared = outputs.Prepare(*config); !prepared) return tl::unexpected(prepared.error());

  RunFacts facts;
  facts.bags = options.bags;
  facts.rig = rig->name;
  const auto start = std::chrono::steady_clock::now();
  const ThreadLimit threads(options.threads);
  const InterruptGuard guard;
  Slam slam(*config, *rig);
  slam.events().Subscribe([&](const Event& event) {
    facts.events.push_back(event);
    fmt::print(stderr, "\n{}: {}\n", event.source, event.message);
  });
  DataSpan span;
  const std::optional<Error> ended = Feed(**source, slam, guard, span);
  slam.Finish();
  facts.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  facts.data_duration_s = span.seconds();
  facts.notes = (*source)->Notes();
  facts.read = (*source)->Counts();
  Judge(slam, *rig, guard, ended, facts);
  if (const auto written = outputs.Write(slam, MakeSummary(facts, slam, *rig)); !written) {
    return tl::unexpected(written.error());
  }
  for (const std::string& note : facts.notes) fmt::print(stderr, "{}\n", note);
  PrintReport(options, slam, facts);
  return ExitCode(slam, *rig, facts);
}

void AddConfigDocsCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("config-docs", "Print the configuration page (Markdown)");
  command->group("");  // for maintainers: docs/configuration.md is made by it
  command->callback([] {
    SlamConfig config;
    fmt::print("# Configuration of `mlvi run`\n\nSet by `--config FILE` (YAML, nested by the dots) or `--set key=value`."
               "\n\n{}",
               ConfigDeclaration::Of(config).ToMarkdown());
  });
}

}  // namespace

void AddRunCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Estimate trajectory and map from recordings");
  command->add_option("bags", options->bags, "ROS 1 bags, in order of time")->required();
  command->add_option("--rig", options->rig, "Rig file, or the name of a built-in rig")->required();
  command->add_option("-o,--output", options->output, "Folder for the results")->required();
  command->add_option("--config", options->config, "Configuration file (YAML)");
  command->add_option("--set", options->assignments, "Override one configuration value: key=value");
  command->add_option("--cameras", options->cameras, "Cameras to use: all, none (the default), or names with commas between");
  command->add_flag("--no-lidar", options->no_lidar, "Do without the LiDAR: cameras and IMU alone");
  command->add_flag("--no-loop", options->no_loop, "Do not close loops (none are closed yet)");
  command->add_option("--compensation", options->compensation, "Panoramic compensation of visual odometry")
      ->check(CLI::IsMember({"none", "plane", "ray"}));
  command->add_option("--threads", options->threads, "Number of threads (0: all cores); results do not depend on it")
      ->check(CLI::NonNegativeNumber);
  command->callback([options, &exit_code] { exit_code = Report(Run(*options)); });
  AddConfigDocsCommand(app);
}

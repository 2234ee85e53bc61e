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
  std::string compensation = "ray";
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
  if (const auto agree = declaration.Check(); !agree) return tl::unexpected(agree.error());
  return config;
}

Expected<Rig> ResolveRig(const RunOptions& options) {
  Expected<Rig> rig = LoadRig(options.rig);
  if (!rig) return rig;
  if (!rig->lidar) {
    return MakeError(ErrorKind::kConfiguration, "rig '{}' has no lidar; `run` estimates from LiDAR and IMU", rig->name);
  }
  if (options.no_lidar || options.cameras != "none") {
    return MakeError(ErrorKind::kConfiguration,
                     "visual odometry is not part of this version: --no-lidar and --cameras other than 'none' cannot "
                     "be used yet");
  }
  return rig;
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

void Judge(const Slam& slam, const InterruptGuard& guard, const std::optional<Error>& ended, RunFacts& facts) {
  const OdometryReport& odometry = slam.supervisor().odometry();
  if (guard.interrupted()) {
    facts.status = "interrupted";
    facts.reason = "interrupted by a signal; what was estimated until then is kept";
  } else if (ended) {
    facts.status = "input_broken_off";
    facts.reason = ended->message;
  } else if (!odometry.initialized) {
    facts.status = "failed";
    facts.reason = "no first state was found: see events";
  } else if (odometry.lost) {
    facts.status = "failed";
    facts.reason = odometry.lost_reason;
  } else {
    facts.status = "ok";
    if (!odometry.resets.empty()) {
      facts.status = "degraded";
      facts.reason = fmt::format("odometry: {} resets, the first: {}", odometry.resets.size(), odometry.resets.front().reason);
    }
    for (const auto& [name, report] : slam.supervisor().streams()) {
      if (report.health.level == HealthLevel::kHealthy) continue;
      facts.status = "degraded";
      facts.reason += fmt::format("{}{}: {}", facts.reason.empty() ? "" : "; ", name, report.health.reason);
    }
  }
}

int ExitCode(const Slam& slam, const RunFacts& facts) {
  if (facts.status == "interrupted") return kExitInterrupted;
  if (facts.status == "input_broken_off") return kExitInput;
  if (facts.status != "failed") return kExitDone;
  const auto& lidar = slam.supervisor().streams().at("lidar");
  const auto& imu = slam.supervisor().streams().at("imu");
  return lidar.used == 0 && (imu.received == 0 || lidar.received < 2) ? kExitInput : kExitEstimation;
}

void PrintReport(const RunOptions& options, const Slam& slam, const RunFacts& facts) {
  const auto stages = slam.times().Summarize();
  const auto sweep = stages.find("sweep");
  fmt::print("status      {}{}{}\n", facts.status, facts.reason.empty() ? "" : ": ", facts.reason);
  fmt::print("poses       {} ({} keyframes, {} loops, {} resets)\n", slam.odometry().size(),
             slam.graph().keyframes().size(), slam.graph().loops(), slam.supervisor().odometry().resets.size());
  if (sweep != stages.end()) {
    fmt::print("per sweep   p50 {:.1f} ms, p99 {:.1f} ms\n", sweep->second.p50_ms, sweep->second.p99_ms);
  }
  fmt::print("time        {:.1f} s of data in {:.1f} s\n", facts.data_duration_s, facts.wall_s);
  fmt::print("results     {}\n", options.output);
}

Expected<int> Run(const RunOptions& options) {
  const Expected<SlamConfig> config = ResolveConfig(options);
  if (!config) return tl::unexpected(config.error());
  const Expected<Rig> rig = ResolveRig(options);
  if (!rig) return tl::unexpected(rig.error());
  auto source = RosBagSource::Open(options.bags, *rig);
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
  Judge(slam, guard, ended, facts);
  if (const auto written = outputs.Write(slam, MakeSummary(facts, slam, *rig)); !written) {
    return tl::unexpected(written.error());
  }
  for (const std::string& note : facts.notes) fmt::print(stderr, "{}\n", note);
  PrintReport(options, slam, facts);
  return ExitCode(slam, facts);
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
  command->add_option("--cameras", options->cameras, "Cameras to use: none (visual odometry is not there yet)");
  command->add_flag("--no-lidar", options->no_lidar, "Do without the LiDAR (needs visual odometry)");
  command->add_flag("--no-loop", options->no_loop, "Do not close loops (none are closed yet)");
  command->add_option("--compensation", options->compensation, "Panoramic compensation (of visual odometry)")
      ->check(CLI::IsMember({"none", "plane", "ray"}));
  command->add_option("--threads", options->threads, "Number of threads (0: all cores); results do not depend on it")
      ->check(CLI::NonNegativeNumber);
  command->callback([options, &exit_code] { exit_code = Report(Run(*options)); });
  AddConfigDocsCommand(app);
}

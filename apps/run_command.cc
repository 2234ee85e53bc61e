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

#include "depth_pictures.h"
#include "exit_code.h"
#include "interrupt.h"
#include "mlvi/base/parallel.h"
#include "mlvi/base/progress.h"
#include "mlvi/io/config_file.h"
#include "mlvi/io/rig_file.h"
#include "mlvi/io/ros_bag_source.h"
#include "mlvi/pipeline/slam.h"
#include "mlvi/sensors/visible_share.h"
#include "mlvi/vio/calibrated_rig.h"
#include "option_values.h"
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
  double depth_pictures = 0.0;  // s between them; 0: none
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
    if (const auto set = declaration.SetAssignment(assignment); !set)
      return tl::unexpected(set.error());
  }
  if (!options.compensation.empty()) {
    const auto set = declaration.SetAssignment("vio.window.compensation=" + options.compensation);
    if (!set) return tl::unexpected(set.error());
  }
  if (const auto agree = declaration.Check(); !agree) return tl::unexpected(agree.error());
  if (const auto valid = config.visual.vio.tracker.Validate(); !valid)
    return tl::unexpected(valid.error());
  return config;
}

// `all` takes what the recording holds; cameras asked for by name must be in it.
RosBagSourceOptions SourceOptions(const RunOptions& options, const SlamConfig& config,
                                  const Rig& rig) {
  return {.use_lidar = rig.lidar.has_value(),
          .cameras = rig.CameraNames(),
          .cameras_required = options.cameras != "all",
          .max_image_rate = config.visual.sets.max_rate,
          .image_tolerance = config.visual.sets.tolerance};
}

// How much the recording holds, as far as it was read: pauses between its parts and jumps of the
// clock are no data.
class DataSpan {
 public:
  explicit DataSpan(double longest_step) : longest_step_(longest_step) {}

  void Add(Time stamp) {
    const double step = newest_.valid() ? (stamp - newest_).seconds() : 0.0;
    if (step > 0.0 && step <= longest_step_) seconds_ += step;
    // Streams arrive a little out of order among each other; a larger step back is a jump.
    if (!newest_.valid() || step > 0.0 || step < -longest_step_) newest_ = stamp;
  }
  double seconds() const { return seconds_; }

 private:
  double longest_step_;  // s
  double seconds_ = 0.0;
  Time newest_;
};

// Feeds the recording to `slam`; returns why it ended early, if it did.
std::optional<Error> Feed(MeasurementSource& source, Slam& slam, DepthPictures* pictures,
                          const InterruptGuard& guard, DataSpan& span) {
  ProgressBar progress("run", stderr);
  while (!guard.interrupted()) {
    Expected<std::optional<Measurement>> next = source.Next();
    if (!next) return next.error();
    if (!*next) break;
    span.Add(AvailableAt(**next));
    if (const auto* image = std::get_if<Image>(&**next); image != nullptr && pictures != nullptr)
      pictures->Take(*image);
    slam.Process(**next);
    if (pictures != nullptr) pictures->Write(slam);
    progress.Update(source.Progress(), fmt::format("{} poses", slam.odometry().size()));
  }
  if (!guard.interrupted()) progress.Finish();
  return std::nullopt;
}

void PrintReport(const RunOptions& options, const Slam& slam, const RunFacts& facts) {
  const auto stages = slam.times().Summarize();
  fmt::print("status      {}{}{}\n", ToString(facts.verdict.status),
             facts.verdict.reason.empty() ? "" : ": ", facts.verdict.reason);
  fmt::print("poses       {} ({} keyframes, {} loops, {} resets)\n", slam.odometry().size(),
             slam.graph().keyframes().size(), slam.graph().loops(),
             slam.supervisor().odometry().resets.size());
  for (const auto& [stage, label] :
       {std::pair("sweep", "per sweep "), std::pair("image_set", "per images")}) {
    const auto times = stages.find(stage);
    if (times == stages.end()) continue;
    fmt::print("{}  p50 {:.1f} ms, p99 {:.1f} ms\n", label, times->second.p50_ms,
               times->second.p99_ms);
  }
  fmt::print("time        {:.1f} s of data in {:.1f} s\n", facts.data_duration_s, facts.wall_s);
  fmt::print("results     {}\n", options.output);
}

// Millimetres taken for metres are the commonest slip in a rig file.
void WarnOfLeverArms(const Rig& rig, const EventBus& events) {
  constexpr double kUnusual = 3.0;  // m: more than a vehicle's roof needs
  const auto check = [&](const std::string& source, const std::string& field,
                         const Pose3& T_body_sensor) {
    const double arm = T_body_sensor.translation().norm();
    if (arm <= kUnusual) return;
    events.Raise({.severity = Severity::kWarning,
                  .source = source,
                  .message = fmt::format(
                      "{} puts it {:.2f} m from the IMU: is that in metres, and not the inverse?",
                      field, arm)});
  };
  if (rig.lidar) check("lidar", "T_body_lidar", rig.lidar->T_body_lidar);
  for (const CameraSpec& camera : rig.cameras)
    check(camera.name, "T_body_camera", camera.T_body_camera);
}

// A mask that is nearly all zero: of the other polarity, but for its rim.
void WarnOfMasks(const Rig& rig, const EventBus& events) {
  constexpr double kUnusual = 0.01;
  for (const CameraSpec& camera : rig.cameras) {
    const double visible = VisibleShare(camera);
    if (visible >= kUnusual) continue;
    events.Raise({.severity = Severity::kWarning,
                  .source = camera.name,
                  .message = fmt::format("mask and valid radius leave {:.2f} % of its images "
                                         "visible: is the mask inverted (zero: not used)?",
                                         100.0 * visible)});
  }
}

// Reads `source` to its end and judges what came of it. `pictures` may be null.
void Estimate(RosBagSource& source, const SlamConfig& config, Slam& slam, DepthPictures* pictures,
              RunFacts& facts) {
  const auto start = std::chrono::steady_clock::now();
  const InterruptGuard guard;
  slam.events().Subscribe([&](const Event& event) {
    facts.events.push_back(event);
    fmt::print(stderr, "\n{}: {}\n", event.source, event.message);
  });
  WarnOfLeverArms(source.rig(), slam.events());
  WarnOfMasks(source.rig(), slam.events());
  DataSpan span(config.sequencer.max_future_jump);
  const std::optional<Error> ended = Feed(source, slam, pictures, guard, span);
  slam.Finish(source.Dropped());
  facts.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  facts.data_duration_s = span.seconds();
  facts.notes = source.Notes();
  facts.read = source.Counts();
  facts.verdict = Judge(slam, source.rig(), source, guard.interrupted(), ended);
}

Expected<int> Run(const RunOptions& options) {
  const Expected<SlamConfig> config = ResolveConfig(options);
  if (!config) return tl::unexpected(config.error());
  const Expected<Rig> whole = LoadRig(options.rig);
  if (!whole) return tl::unexpected(whole.error());
  const Expected<Rig> selected = SelectSensors(*whole, options.cameras, options.no_lidar);
  if (!selected) return tl::unexpected(selected.error());
  if (const auto fits = CheckRig(*config, *selected); !fits) return tl::unexpected(fits.error());
  auto source =
      RosBagSource::Open(options.bags, *selected, SourceOptions(options, *config, *selected));
  if (!source) return tl::unexpected(source.error());
  const bool draws = options.depth_pictures > 0.0;
  if (draws && (!(*source)->rig().lidar || (*source)->rig().cameras.empty())) {
    return MakeError(ErrorKind::kConfiguration,
                     "--depth-pictures draws what the LiDAR sees over images: it needs a LiDAR and "
                     "cameras (--cameras), both in the recording");
  }
  const RunOutputs outputs(options.output);
  if (const auto prepared = outputs.Prepare(*config, draws); !prepared)
    return tl::unexpected(prepared.error());

  const Rig& rig = (*source)->rig();
  RunFacts facts{.bags = options.bags, .rig = rig.name};
  const ThreadLimit threads(options.threads);
  Slam slam(*config, rig);
  std::optional<DepthPictures> pictures;
  if (draws) {
    pictures.emplace(outputs.depth_pictures(), options.depth_pictures, *config, rig);
  }
  Estimate(**source, *config, slam, pictures ? &*pictures : nullptr, facts);
  // For the next run, sensors that did not take part stay in the rig file.
  const auto calibrated = [&](const Rig& of) {
    Rig result =
        slam.visual() ? CalibratedRig(of, rig.CameraNames(), slam.visual()->calibration()) : of;
    if (result.lidar && slam.KnowsTimeOffset()) {
      Duration& offset = result.lidar->time_offset;
      offset = offset + Duration::FromSeconds(slam.lidar_time_offset().seconds);
    }
    return result;
  };
  const auto written =
      outputs.Write(slam, calibrated(*whole),
                    MakeSummary(facts, slam, calibrated(rig), config->visual.vio.window));
  for (const std::string& note : facts.notes) fmt::print(stderr, "{}\n", note);
  PrintReport(options, slam, facts);
  if (!written) return tl::unexpected(written.error());
  if (pictures && pictures->error()) return tl::unexpected(*pictures->error());
  return facts.verdict.exit_code;
}

void AddConfigDocsCommand(CLI::App& app) {
  CLI::App* command = app.add_subcommand("config-docs", "Print the configuration page (Markdown)");
  command->group("");  // for maintainers: docs/configuration.md is made by it
  command->callback([] {
    SlamConfig config;
    fmt::print(
        "# Configuration of `mlvi run`\n\nSet by `--config FILE` (YAML, nested by the dots) or "
        "`--set key=value`."
        "\n\n{}",
        ConfigDeclaration::Of(config).ToMarkdown());
  });
}

}  // namespace

void AddRunCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Estimate trajectory and map from recordings");
  command->add_option("bags", options->bags, "ROS 1 bags: the parts of one recording")->required();
  command->add_option("--rig", options->rig, "Rig file, or the name of a built-in rig")->required();
  command->add_option("-o,--output", options->output, "Folder for the results")->required();
  command->add_option("--config", options->config, "Configuration file (YAML)");
  command->add_option("--set", options->assignments, "Override one configuration value: key=value");
  command->add_option("--cameras", options->cameras,
                      "Cameras to use: all, none (the default), or names with commas between");
  command->add_flag("--no-lidar", options->no_lidar, "Do without the LiDAR: cameras and IMU alone");
  command->add_flag("--no-loop", options->no_loop, "Do not close loops (none are closed yet)");
  command
      ->add_option("--compensation", options->compensation,
                   "Panoramic compensation of visual odometry")
      ->check(CLI::IsMember({"none", "plane", "ray"}));
  command
      ->add_option("--depth-pictures", options->depth_pictures,
                   "Every so many seconds a picture per camera with the LiDAR's depth drawn in")
      ->check(CLI::PositiveNumber);
  AddThreadsOption(*command, options->threads);
  command->callback([options, &exit_code] { exit_code = Report(Run(*options)); });
  AddConfigDocsCommand(app);
}

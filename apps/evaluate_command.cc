// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluate_command.h"

#include <fmt/format.h>

#include <memory>
#include <numbers>

#include "evaluation_report.h"
#include "exit_code.h"
#include "mlvi/eval/evaluation.h"
#include "option_values.h"
#include "pose_file.h"

namespace {

using mlvi::Expected;

// Of any time or length: what int64 nanoseconds still hold.
constexpr double kLargest = 9e9;

struct Arguments {
  std::string estimate_file, truth_file;
  double time_offset = 0.0;
  std::vector<double> truth_frame;
  bool json = false;
  mlvi::EvaluationOptions options;
};

Expected<mlvi::Pose3> ParseFrame(const std::vector<double>& v) {
  if (v.empty()) return mlvi::Pose3();
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1.0) > 0.01) {
    return mlvi::MakeError(mlvi::ErrorKind::kConfiguration,
                           "--truth-frame: quaternion norm {:.4f}; expected x y z qx qy qz qw",
                           q.norm());
  }
  return mlvi::Pose3(q, {v[0], v[1], v[2]});
}

Expected<mlvi::EvaluationOptions> ToOptions(const Arguments& a) {
  mlvi::EvaluationOptions options = a.options;
  options.association.estimate_offset = mlvi::Duration::FromSeconds(a.time_offset);
  if (options.relative.unit == mlvi::DeltaUnit::kRadians) {
    options.relative.delta *= std::numbers::pi / 180.0;  // typed in degrees
  }
  const auto frame = ParseFrame(a.truth_frame);
  if (!frame) return tl::unexpected(frame.error());
  options.T_body_truth = *frame;
  return options;
}

Expected<mlvi::Evaluation> EvaluateFiles(const Arguments& a,
                                         const mlvi::EvaluationOptions& options) {
  const auto estimate = ReadPoseFile(a.estimate_file);
  if (!estimate) return tl::unexpected(estimate.error());
  const auto truth = ReadPoseFile(a.truth_file);
  if (!truth) return tl::unexpected(truth.error());
  if (estimate->has_stamps() != truth->has_stamps()) {
    return mlvi::MakeError(
        mlvi::ErrorKind::kInput,
        "{} has stamps and {} has none (KITTI): poses cannot be matched; convert one of them",
        estimate->has_stamps() ? a.estimate_file : a.truth_file,
        estimate->has_stamps() ? a.truth_file : a.estimate_file);
  }
  return estimate->has_stamps() ? mlvi::Evaluate(estimate->stamped, truth->stamped, options)
                                : mlvi::Evaluate(estimate->unstamped, truth->unstamped, options);
}

Expected<int> Run(const Arguments& a) {
  const auto options = ToOptions(a);
  if (!options) return tl::unexpected(options.error());
  const auto evaluation = EvaluateFiles(a, *options);
  if (!evaluation) return tl::unexpected(evaluation.error());
  if (a.json) {
    fmt::print("{}\n", ToJson(*evaluation, *options).dump(2));
  } else {
    fmt::print("{}", ToTable(*evaluation, *options));
  }
  return kExitDone;
}

void AddAssociationOptions(CLI::App& command, Arguments& a) {
  auto& o = a.options.association;
  AddChoice<mlvi::AssociationKind>(command, "--association", o.kind,
                                   {{"interpolate", mlvi::AssociationKind::kInterpolate},
                                    {"nearest", mlvi::AssociationKind::kNearest}},
                                   "How poses are matched in time (nearest: as evo)");
  command
      .add_option("--max-difference", o.max_difference, "Largest difference in time of a pair [s]")
      ->check(NumberIn(0.0, kLargest))
      ->capture_default_str();
  command.add_option("--max-gap", o.max_gap, "Longest gap that is interpolated [s]")
      ->check(NumberIn(0.0, kLargest))
      ->capture_default_str();
  command.add_option("--time-offset", a.time_offset, "Added to the stamps of the estimate [s]")
      ->check(NumberIn(-kLargest, kLargest))
      ->capture_default_str();
  command
      .add_option(
          "--truth-frame", a.truth_frame,
          "Frame that the truth describes, placed in the estimate's body frame: x y z qx qy qz qw")
      ->expected(7)
      ->check(NumberIn(-kLargest, kLargest));
}

void AddErrorOptions(CLI::App& command, Arguments& a) {
  auto& r = a.options.relative;
  std::vector<std::pair<std::string, mlvi::AlignmentKind>> alignments;
  for (const std::string& name : AlignmentNames())
    alignments.emplace_back(name, static_cast<mlvi::AlignmentKind>(alignments.size()));
  AddChoice(command, "--align", a.options.alignment, alignments,
            "Alignment of the estimate to the truth");
  command.add_option("--rpe-delta", r.delta, "Length of the pairs of the relative error")
      ->check(NumberAbove(0.0, kLargest))
      ->capture_default_str();
  AddChoice<mlvi::DeltaUnit>(command, "--rpe-unit", r.unit,
                             {{"m", mlvi::DeltaUnit::kMetres},
                              {"frames", mlvi::DeltaUnit::kFrames},
                              {"deg", mlvi::DeltaUnit::kRadians},
                              {"s", mlvi::DeltaUnit::kSeconds}},
                             "Its unit");
  command.add_flag("--rpe-all-pairs", r.all_pairs,
                   "A pair from every pose on, instead of consecutive ones");
  command
      .add_option("--rpe-tolerance", r.tolerance,
                  "Accepted deviation of a pair's length with all pairs, share of it")
      ->check(NumberIn(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--rpe-from-truth", r.pairs_from_truth,
                   "Measure the pairs along the truth instead of the estimate");
  command.add_flag("--rpe-skip-first", r.skip_first,
                   "Leave out the first consecutive pair, as evo did in 2018");
  command
      .add_option("--segments", a.options.drift_lengths,
                  "Segment lengths of the drift [m]; default: 10 to 50 % of the path")
      ->check(NumberAbove(0.0, kLargest))
      ->delimiter(',');
  command
      .add_option("--coverage-gap", a.options.coverage_gap,
                  "Longer intervals between estimates are gaps [s]")
      ->check(NumberIn(0.0, kLargest))
      ->capture_default_str();
}

}  // namespace

void AddEvaluateCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("evaluate", "Errors of a trajectory against ground truth");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("ESTIMATE", arguments->estimate_file,
                   "Trajectory: TUM, EuRoC csv or KITTI poses")
      ->required();
  command->add_option("TRUTH", arguments->truth_file, "Ground truth, in any of these formats")
      ->required();
  AddErrorOptions(*command, *arguments);
  AddAssociationOptions(*command, *arguments);
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->callback([arguments, &exit_code] { exit_code = Report(Run(*arguments)); });
}

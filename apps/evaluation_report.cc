// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation_report.h"

#include <fmt/format.h>

#include <numbers>

namespace {

using mlvi::ErrorStatistics;
using mlvi::Evaluation;
using mlvi::EvaluationOptions;
using nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / std::numbers::pi;

std::string DeltaText(const mlvi::RelativeErrorOptions& o) {
  switch (o.unit) {
    case mlvi::DeltaUnit::kFrames: return fmt::format("{:g} frames", o.delta);
    case mlvi::DeltaUnit::kMetres: return fmt::format("{:g} m", o.delta);
    case mlvi::DeltaUnit::kRadians: return fmt::format("{:g} deg", o.delta * kDegrees);
    case mlvi::DeltaUnit::kSeconds: return fmt::format("{:g} s", o.delta);
  }
  return "";
}

std::string PairsText(const mlvi::RelativeErrorOptions& o) {
  return fmt::format("{}, {} pairs along the {}", DeltaText(o), o.all_pairs ? "all" : "consecutive",
                     o.pairs_from_truth ? "truth" : "estimate");
}

std::string AssociationText(const EvaluationOptions& o) {
  if (o.association.kind == mlvi::AssociationKind::kNearest) {
    return fmt::format("nearest stamp within {:g} s", o.association.max_difference);
  }
  return fmt::format("denser one interpolated over gaps up to {:g} s", o.association.max_gap);
}

std::string Row(const std::string& name, const ErrorStatistics& s, double scale) {
  return fmt::format(
      "{:<16} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f} {:>10.6f} {:>12.6f} {:>7}\n", name,
      s.rmse * scale, s.mean * scale, s.median * scale, s.std * scale, s.min * scale, s.max * scale,
      s.sse * scale * scale, s.count);
}

std::string StatisticsTable(const Evaluation& e, const EvaluationOptions& options) {
  std::string text = fmt::format("{:<16} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>12} {:>7}\n",
                                 "", "rmse", "mean", "median", "std", "min", "max", "sse", "count");
  text += Row("APE trans [m]", e.absolute_translation, 1.0);
  if (!e.has_rotations)
    return text + "positions only: no rotation errors, relative errors and drift\n";
  text += Row("APE rot [deg]", *e.absolute_rotation, kDegrees);
  if (e.relative_translation) {
    text += Row("RPE trans [m]", *e.relative_translation, 1.0);
    text += Row("RPE rot [deg]", *e.relative_rotation, kDegrees);
  } else {
    text +=
        fmt::format("RPE: no pair of {} fits in this trajectory\n", DeltaText(options.relative));
  }
  return text;
}

std::string DriftTable(const Evaluation& e) {
  if (e.drift.empty()) return "";
  std::string text =
      fmt::format("\ndrift over   {:>10} {:>12} {:>10}\n", "trans [%]", "rot [deg/m]", "segments");
  for (const mlvi::SegmentDrift& d : e.drift) {
    text += fmt::format("{:>10.2f} m {:>10.4f} {:>12.6f} {:>10}\n", d.length, d.translation_percent,
                        d.rotation_deg_per_metre, d.count);
  }
  return text;
}

std::string CoverageText(const mlvi::Coverage& c, double gap) {
  std::string text =
      fmt::format("\ncoverage: {:.2f} % of the truth's {:.3f} s, {} gap(s) longer than {:g} s\n",
                  100.0 * c.share, c.truth_duration, c.gaps.size(), gap);
  for (const mlvi::TimeGap& g : c.gaps) {
    text += fmt::format("  gap {} .. {} ({:.3f} s)\n", ToString(g.from), ToString(g.to),
                        (g.to - g.from).seconds());
  }
  return text;
}

ordered_json StatisticsJson(const ErrorStatistics& s, double scale) {
  return {{"rmse", s.rmse * scale},       {"mean", s.mean * scale}, {"median", s.median * scale},
          {"std", s.std * scale},         {"min", s.min * scale},   {"max", s.max * scale},
          {"sse", s.sse * scale * scale}, {"count", s.count}};
}

ordered_json MatchJson(const Evaluation& e, const EvaluationOptions& o) {
  ordered_json json = {{"estimate_poses", e.estimate_count},
                       {"truth_poses", e.truth_count},
                       {"matched_poses", e.matched}};
  if (!e.first.valid()) {
    json["method"] = "by index";
    return json;
  }
  json["method"] = AssociationText(o);
  json["time_offset_s"] = o.association.estimate_offset.seconds();
  json["first_stamp"] = ToString(e.first);
  json["last_stamp"] = ToString(e.last);
  return json;
}

ordered_json AlignmentJson(const Evaluation& e, const EvaluationOptions& o) {
  const Eigen::Vector3d& t = e.T_truth_estimate.pose.translation();
  const Eigen::Quaterniond& q = e.T_truth_estimate.pose.rotation();
  return {{"kind", AlignmentNames().at(static_cast<std::size_t>(o.alignment))},
          {"meaning", "p_truth = scale * R * p_estimate + t"},
          {"scale", e.T_truth_estimate.scale},
          {"t", {t.x(), t.y(), t.z()}},
          {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

ordered_json CoverageJson(const mlvi::Coverage& c) {
  ordered_json gaps = ordered_json::array();
  for (const mlvi::TimeGap& g : c.gaps) {
    gaps.push_back({{"from", ToString(g.from)},
                    {"to", ToString(g.to)},
                    {"duration_s", (g.to - g.from).seconds()}});
  }
  return {{"truth_duration_s", c.truth_duration},
          {"covered_s", c.covered},
          {"share", c.share},
          {"gaps", gaps}};
}

}  // namespace

std::vector<std::string> AlignmentNames() { return {"none", "se3", "sim3", "yaw"}; }

std::string ToTable(const Evaluation& e, const EvaluationOptions& o) {
  std::string text = fmt::format("matched {} of {} estimated and {} true poses", e.matched,
                                 e.estimate_count, e.truth_count);
  text += e.first.valid() ? fmt::format(" from {} to {}; {}\n", ToString(e.first), ToString(e.last),
                                        AssociationText(o))
                          : " by index\n";
  text += fmt::format(
      "path {:.3f} m; alignment {}, scale {:.6f}; errors in the frame of the truth; RPE over "
      "{}\n\n",
      e.path_length, AlignmentNames().at(static_cast<std::size_t>(o.alignment)),
      e.T_truth_estimate.scale, PairsText(o.relative));
  text += StatisticsTable(e, o) + DriftTable(e);
  if (e.coverage) text += CoverageText(*e.coverage, o.coverage_gap);
  return text;
}

ordered_json ToJson(const Evaluation& e, const EvaluationOptions& o) {
  ordered_json json = {{"association", MatchJson(e, o)},
                       {"alignment", AlignmentJson(e, o)},
                       {"path_length_m", e.path_length}};
  json["ape"]["translation_m"] = StatisticsJson(e.absolute_translation, 1.0);
  if (e.absolute_rotation)
    json["ape"]["rotation_deg"] = StatisticsJson(*e.absolute_rotation, kDegrees);
  json["rpe"]["pairs"] = PairsText(o.relative);
  if (e.relative_translation) {
    json["rpe"]["translation_m"] = StatisticsJson(*e.relative_translation, 1.0);
    json["rpe"]["rotation_deg"] = StatisticsJson(*e.relative_rotation, kDegrees);
  }
  json["drift"] = ordered_json::array();
  for (const mlvi::SegmentDrift& d : e.drift) {
    json["drift"].push_back({{"length_m", d.length},
                             {"translation_percent", d.translation_percent},
                             {"rotation_deg_per_m", d.rotation_deg_per_metre},
                             {"segments", d.count}});
  }
  if (e.coverage) json["coverage"] = CoverageJson(*e.coverage);
  return json;
}

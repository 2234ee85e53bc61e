// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/evaluation.h"

namespace mlvi {
namespace {

std::vector<double> DriftLengths(const EvaluationOptions& options, double path_length) {
  if (!options.drift_lengths.empty()) return options.drift_lengths;
  std::vector<double> lengths;
  for (const double share : {0.1, 0.2, 0.3, 0.4, 0.5}) lengths.push_back(share * path_length);
  if (!(path_length > 0.0)) lengths.clear();
  return lengths;
}

// What needs rotations on both sides.
Expected<void> EvaluateMotion(const PoseMatrices& estimate, const MatchedPoses& matched,
                              const EvaluationOptions& options, Evaluation& result) {
  const auto pairs = SelectPairs(options.relative.pairs_from_truth ? matched.truth : estimate,
                                 matched.stamps, options.relative);
  if (!pairs) return tl::unexpected(pairs.error());
  result.absolute_rotation = Summarize(result.absolute_errors.rotation);
  result.relative_pairs = *pairs;
  result.relative_errors = RelativeErrors(estimate, matched.truth, *pairs);
  if (!pairs->empty()) {
    result.relative_translation = Summarize(result.relative_errors.translation);
    result.relative_rotation = Summarize(result.relative_errors.rotation);
  }
  result.drift = Drift(estimate, matched.truth, DriftLengths(options, result.path_length));
  return {};
}

Expected<Evaluation> EvaluateMatched(MatchedPoses matched, const EvaluationOptions& options) {
  const Eigen::Isometry3d T_body_truth(options.T_body_truth.matrix());
  for (Eigen::Isometry3d& pose : matched.estimate) pose = pose * T_body_truth;
  const auto alignment = AlignEstimate(matched, options.alignment);
  if (!alignment) return tl::unexpected(alignment.error());
  const PoseMatrices estimate = Align(matched.estimate, *alignment);
  Evaluation result{.estimate_count = matched.estimate_count,
                    .truth_count = matched.truth_count,
                    .matched = estimate.size(),
                    .path_length = CumulativeDistance(matched.truth).back(),
                    .T_truth_estimate = *alignment,
                    .has_rotations = matched.has_rotations,
                    .absolute_errors = AbsoluteErrors(estimate, matched.truth)};
  if (!matched.stamps.empty()) {
    result.first = matched.stamps.front();
    result.last = matched.stamps.back();
  }
  result.absolute_translation = Summarize(result.absolute_errors.translation);
  if (!matched.has_rotations) {
    result.absolute_errors.rotation.clear();
    return result;
  }
  if (auto done = EvaluateMotion(estimate, matched, options, result); !done)
    return tl::unexpected(done.error());
  return result;
}

}  // namespace

Expected<Evaluation> Evaluate(const Trajectory& estimate, const Trajectory& truth,
                              const EvaluationOptions& options) {
  auto matched = Associate(estimate, truth, options.association);
  if (!matched) return tl::unexpected(matched.error());
  auto result = EvaluateMatched(std::move(*matched), options);
  if (result) {
    result->coverage =
        ComputeCoverage(estimate, truth, options.coverage_gap, options.association.estimate_offset);
  }
  return result;
}

Expected<Evaluation> Evaluate(const PoseMatrices& estimate, const PoseMatrices& truth,
                              const EvaluationOptions& options) {
  auto matched = AssociateByIndex(estimate, truth);
  if (!matched) return tl::unexpected(matched.error());
  return EvaluateMatched(std::move(*matched), options);
}

}  // namespace mlvi

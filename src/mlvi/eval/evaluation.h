// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A trajectory against ground truth: everything that `mlvi evaluate` reports.
#pragma once

#include <optional>
#include <vector>

#include "mlvi/eval/association.h"
#include "mlvi/eval/coverage.h"
#include "mlvi/eval/error_statistics.h"
#include "mlvi/eval/pose_errors.h"

namespace mlvi {

struct EvaluationOptions {
  AssociationOptions association{};
  AlignmentKind alignment = AlignmentKind::kSe3;
  RelativeErrorOptions relative{};
  std::vector<double>
      drift_lengths{};        // m; empty: 10, 20, 30, 40 and 50 % of the matched truth's length
  double coverage_gap = 1.0;  // s; see ComputeCoverage
  Pose3 T_body_truth{};  // the frame that the truth describes, placed in the one of the estimate
};

struct Evaluation {
  std::size_t estimate_count = 0, truth_count = 0, matched = 0;
  Time first{}, last{};      // instants of the first and last matched pair; invalid without stamps
  double path_length = 0.0;  // m, of the matched truth
  Similarity3 T_truth_estimate{};
  // False when one side knows positions only: then everything about rotations, relative errors and
  // drift is empty.
  bool has_rotations = true;
  PoseErrors absolute_errors{};
  ErrorStatistics absolute_translation{};              // m
  std::optional<ErrorStatistics> absolute_rotation{};  // rad
  PoseErrors relative_errors{};
  std::vector<IndexPair> relative_pairs{};
  std::optional<ErrorStatistics>
      relative_translation{};                          // m; empty when no pair of that length fits
  std::optional<ErrorStatistics> relative_rotation{};  // rad
  std::vector<SegmentDrift> drift{};
  std::optional<Coverage> coverage{};  // empty without stamps
};

// Errors: of Associate, AlignPoints and SelectPairs.
Expected<Evaluation> Evaluate(const Trajectory& estimate, const Trajectory& truth,
                              const EvaluationOptions& options);
// Poses without stamps, pose i with pose i.
Expected<Evaluation> Evaluate(const PoseMatrices& estimate, const PoseMatrices& truth,
                              const EvaluationOptions& options);

}  // namespace mlvi

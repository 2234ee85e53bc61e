// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Absolute and relative pose errors (Sturm et al. 2012) and drift over distance (Geiger et al.,
// KITTI odometry, 2012).
#pragma once

#include <utility>
#include <vector>

#include "mlvi/base/error.h"
#include "mlvi/eval/association.h"
#include "mlvi/geometry/alignment.h"

namespace mlvi {

struct PoseErrors {
  std::vector<double> translation{};  // m
  std::vector<double> rotation{};     // rad, in [0, pi]
};

// The estimate in the frame of the truth.
PoseMatrices Align(const PoseMatrices& estimate, const Similarity3& T_truth_estimate);
// The alignment of the matched positions. Errors: see AlignPoints.
Expected<Similarity3> AlignEstimate(const MatchedPoses& matched, AlignmentKind kind);

// Of every pose: distance of the positions, angle between the rotations. Contract: equal numbers.
PoseErrors AbsoluteErrors(const PoseMatrices& estimate, const PoseMatrices& truth);

enum class DeltaUnit : int { kFrames = 0, kMetres = 1, kRadians = 2, kSeconds = 3 };

struct RelativeErrorOptions {
  double delta = 1.0;  // length of a pair, in units of
  DeltaUnit unit = DeltaUnit::kMetres;
  // false: consecutive pairs, each starts where the last ended. true: a pair from every pose on, to
  // the one nearest in length (radians: to every one) that is within `tolerance`; angles are then
  // direct, not accumulated.
  bool all_pairs = false;
  double tolerance = 0.1;         // share of delta
  bool pairs_from_truth = false;  // measure delta along the truth, instead of along the estimate
  // Leave out the first consecutive pair, as versions of evo of about 2018 did.
  bool skip_first = false;
};

using IndexPair = std::pair<std::size_t, std::size_t>;

// The pairs of poses between which relative errors are taken. Errors (kConfiguration): delta not
// positive or not an integer for frames; seconds without stamps. The result may be empty, when the
// trajectory is too short.
Expected<std::vector<IndexPair>> SelectPairs(const PoseMatrices& poses,
                                             const std::vector<Time>& stamps,
                                             const RelativeErrorOptions& options);

// Of E = (T_truth_i^-1 T_truth_j)^-1 (T_est_i^-1 T_est_j), for each pair (i, j).
PoseErrors RelativeErrors(const PoseMatrices& estimate, const PoseMatrices& truth,
                          const std::vector<IndexPair>& pairs);

// Error per distance over all segments of one length, measured along the truth and started at every
// pose.
struct SegmentDrift {
  double length = 0.0;  // m
  std::size_t count = 0;
  double translation_percent = 0.0;     // mean of |t| / length
  double rotation_deg_per_metre = 0.0;  // mean of angle / length
};

// One entry per length that fits in the trajectory.
std::vector<SegmentDrift> Drift(const PoseMatrices& estimate, const PoseMatrices& truth,
                                const std::vector<double>& lengths);

// Path length from the first pose to each pose, m.
std::vector<double> CumulativeDistance(const PoseMatrices& poses);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/pose_errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

Eigen::Isometry3d Between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return a.inverse() * b;
}

double Angle(const Eigen::Isometry3d& T) {
  return LogSo3(Eigen::Quaterniond(T.linear()).normalized()).norm();
}

// The error of the motion from pose i to pose j.
Eigen::Isometry3d RelativeError(const PoseMatrices& estimate, const PoseMatrices& truth,
                                IndexPair pair) {
  return Between(Between(truth[pair.first], truth[pair.second]),
                 Between(estimate[pair.first], estimate[pair.second]));
}

// What has been travelled up to each pose, in the unit of the pairs.
std::vector<double> Travelled(const PoseMatrices& poses, const std::vector<Time>& stamps,
                              DeltaUnit unit) {
  if (unit == DeltaUnit::kMetres) return CumulativeDistance(poses);
  std::vector<double> travelled(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    switch (unit) {
      case DeltaUnit::kRadians:
        travelled[i] = travelled[i - 1] + Angle(Between(poses[i - 1], poses[i]));
        break;
      case DeltaUnit::kSeconds: travelled[i] = (stamps[i] - stamps[0]).seconds(); break;
      default: travelled[i] = static_cast<double>(i);
    }
  }
  return travelled;
}

std::vector<IndexPair> ConsecutivePairs(const std::vector<double>& travelled, double delta) {
  std::vector<IndexPair> pairs;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < travelled.size(); ++i) {
    if (travelled[i] - travelled[begin] < delta) continue;
    pairs.emplace_back(begin, i);
    begin = i;
  }
  return pairs;
}

std::vector<IndexPair> NearestPairs(const std::vector<double>& travelled, double delta,
                                    double tolerance) {
  std::vector<IndexPair> pairs;
  for (std::size_t i = 0; i + 1 < travelled.size(); ++i) {
    const double target = travelled[i] + delta;
    const auto first = travelled.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    auto best = std::lower_bound(first, travelled.end(), target);
    if (best == travelled.end()) --best;
    if (best != first && target - *(best - 1) <= *best - target) --best;
    // The first of several poses at the same place.
    best = std::lower_bound(first, best, *best);
    if (std::abs(*best - target) <= tolerance) pairs.emplace_back(i, best - travelled.begin());
  }
  return pairs;
}

std::vector<IndexPair> PairsByDirectAngle(const PoseMatrices& poses, double delta,
                                          double tolerance) {
  std::vector<IndexPair> pairs;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      if (std::abs(Angle(Between(poses[i], poses[j])) - delta) <= tolerance)
        pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

Expected<void> CheckOptions(const RelativeErrorOptions& options, bool stamped) {
  constexpr ErrorKind kKind = ErrorKind::kConfiguration;
  if (!(options.delta > 0.0))
    return MakeError(kKind, "relative error: delta = {}: must be positive", options.delta);
  if (options.unit == DeltaUnit::kFrames && options.delta != std::floor(options.delta)) {
    return MakeError(kKind, "relative error: delta = {} frames: must be an integer", options.delta);
  }
  if (options.unit == DeltaUnit::kSeconds && !stamped) {
    return MakeError(
        kKind, "relative error: delta in seconds needs poses with stamps; use frames or metres");
  }
  return {};
}

}  // namespace

std::vector<double> CumulativeDistance(const PoseMatrices& poses) {
  std::vector<double> distance(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    distance[i] = distance[i - 1] + (poses[i].translation() - poses[i - 1].translation()).norm();
  }
  return distance;
}

PoseMatrices Align(const PoseMatrices& estimate, const Similarity3& T_truth_estimate) {
  PoseMatrices aligned = estimate;
  const Eigen::Matrix3d R = T_truth_estimate.pose.R();
  for (Eigen::Isometry3d& pose : aligned) {
    pose.linear() = R * pose.linear();
    pose.translation() =
        T_truth_estimate.scale * (R * pose.translation()) + T_truth_estimate.pose.translation();
  }
  return aligned;
}

Expected<Similarity3> AlignEstimate(const MatchedPoses& matched, AlignmentKind kind) {
  std::vector<Eigen::Vector3d> source, target;
  for (const Eigen::Isometry3d& pose : matched.estimate) source.emplace_back(pose.translation());
  for (const Eigen::Isometry3d& pose : matched.truth) target.emplace_back(pose.translation());
  return AlignPoints(source, target, kind);
}

PoseErrors AbsoluteErrors(const PoseMatrices& estimate, const PoseMatrices& truth) {
  MLVI_CHECK(estimate.size() == truth.size(), "{} estimates, {} truths", estimate.size(),
             truth.size());
  PoseErrors errors;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    errors.translation.push_back((estimate[i].translation() - truth[i].translation()).norm());
    errors.rotation.push_back(Angle(Between(estimate[i], truth[i])));
  }
  return errors;
}

Expected<std::vector<IndexPair>> SelectPairs(const PoseMatrices& poses,
                                             const std::vector<Time>& stamps,
                                             const RelativeErrorOptions& options) {
  if (auto valid = CheckOptions(options, !stamps.empty()); !valid)
    return tl::unexpected(valid.error());
  const double tolerance = options.tolerance * options.delta;
  if (options.all_pairs && options.unit == DeltaUnit::kRadians) {
    return PairsByDirectAngle(poses, options.delta, tolerance);
  }
  const std::vector<double> travelled = Travelled(poses, stamps, options.unit);
  if (options.all_pairs) {
    return NearestPairs(travelled, options.delta,
                        options.unit == DeltaUnit::kFrames ? 0.0 : tolerance);
  }
  std::vector<IndexPair> pairs = ConsecutivePairs(travelled, options.delta);
  if (options.skip_first && !pairs.empty()) pairs.erase(pairs.begin());
  return pairs;
}

PoseErrors RelativeErrors(const PoseMatrices& estimate, const PoseMatrices& truth,
                          const std::vector<IndexPair>& pairs) {
  MLVI_CHECK(estimate.size() == truth.size(), "{} estimates, {} truths", estimate.size(),
             truth.size());
  PoseErrors errors;
  for (const IndexPair& pair : pairs) {
    const Eigen::Isometry3d error = RelativeError(estimate, truth, pair);
    errors.translation.push_back(error.translation().norm());
    errors.rotation.push_back(Angle(error));
  }
  return errors;
}

std::vector<SegmentDrift> Drift(const PoseMatrices& estimate, const PoseMatrices& truth,
                                const std::vector<double>& lengths) {
  const std::vector<double> distance = CumulativeDistance(truth);
  std::vector<SegmentDrift> drift;
  for (const double length : lengths) {
    SegmentDrift segment{.length = length};
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const auto end = std::lower_bound(distance.begin(), distance.end(), distance[i] + length);
      if (end == distance.end()) break;
      const auto j = static_cast<std::size_t>(end - distance.begin());
      const Eigen::Isometry3d error = RelativeError(estimate, truth, {i, j});
      ++segment.count;
      segment.translation_percent += 100.0 * error.translation().norm() / length;
      segment.rotation_deg_per_metre += kDegrees * Angle(error) / length;
    }
    if (segment.count == 0) continue;
    segment.translation_percent /= static_cast<double>(segment.count);
    segment.rotation_deg_per_metre /= static_cast<double>(segment.count);
    drift.push_back(segment);
  }
  return drift;
}

}  // namespace mlvi

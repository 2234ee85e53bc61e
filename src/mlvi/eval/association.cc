// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/eval/association.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace mlvi {
namespace {

constexpr ErrorKind kKind = ErrorKind::kInput;

Expected<Trajectory> Sorted(const Trajectory& trajectory, const char* name, Duration offset) {
  if (trajectory.empty()) return MakeError(kKind, "the {} holds no poses", name);
  Trajectory sorted = trajectory;
  for (StampedPose& p : sorted) {
    if (!p.stamp.valid() || !p.pose.translation().allFinite() ||
        !p.pose.rotation().coeffs().allFinite()) {
      return MakeError(kKind, "the {} holds a pose that is not finite, at stamp {}", name,
                       ToString(p.stamp));
    }
    p.stamp = p.stamp + offset;
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
  return sorted;
}

std::string Range(const Trajectory& t) {
  return fmt::format("[{}, {}]", ToString(t.front().stamp), ToString(t.back().stamp));
}

Expected<void> CheckOverlap(const Trajectory& estimate, const Trajectory& truth, Duration slack) {
  if (estimate.front().stamp <= truth.back().stamp + slack &&
      truth.front().stamp <= estimate.back().stamp + slack) {
    return {};
  }
  const double offset = (truth.front().stamp - estimate.front().stamp).seconds();
  return MakeError(kKind,
                   "no overlap in time: the estimate covers {} s, the truth {} s. Likely cause: "
                   "clocks with different "
                   "origins, or the truth of another recording; if it is the clock, start to start "
                   "differs by {:.3f} s "
                   "(--time-offset {:.3f} adds it to the estimate)",
                   Range(estimate), Range(truth), offset, offset);
}

// The index of the pose nearest in time; the earlier of two equally near ones.
std::size_t NearestIndex(const Trajectory& dense, Time stamp) {
  const auto after = std::upper_bound(dense.begin(), dense.end(), stamp,
                                      [](Time t, const StampedPose& p) { return t < p.stamp; });
  if (after == dense.begin()) return 0;
  const auto index = static_cast<std::size_t>(after - dense.begin());
  if (after == dense.end()) return index - 1;
  return (after->stamp - stamp) < (stamp - dense[index - 1].stamp) ? index : index - 1;
}

double SecondsApart(Time a, Time b) { return std::abs((a - b).seconds()); }

std::optional<Pose3> Interpolated(const Trajectory& dense, Time stamp,
                                  const AssociationOptions& options) {
  const std::size_t nearest = NearestIndex(dense, stamp);
  const std::size_t begin = dense[nearest].stamp <= stamp ? nearest : nearest - 1;
  const bool near = SecondsApart(dense[nearest].stamp, stamp) <= options.max_difference;
  // Before the first or after the last pose.
  if (nearest == 0 && stamp < dense[0].stamp) return std::nullopt;
  if (begin + 1 >= dense.size()) {
    return dense[begin].stamp == stamp ? std::optional(dense[begin].pose) : std::nullopt;
  }
  const StampedPose &a = dense[begin], &b = dense[begin + 1];
  const double gap = (b.stamp - a.stamp).seconds();
  if (gap > options.max_gap && !near) return std::nullopt;
  return gap > 0.0 ? Interpolate(a.pose, b.pose, (stamp - a.stamp).seconds() / gap) : a.pose;
}

// The pose of `dense` that belongs to the instant.
std::optional<Pose3> Partner(const Trajectory& dense, Time stamp,
                             const AssociationOptions& options) {
  if (options.kind == AssociationKind::kInterpolate) return Interpolated(dense, stamp, options);
  const StampedPose& nearest = dense[NearestIndex(dense, stamp)];
  if (SecondsApart(nearest.stamp, stamp) > options.max_difference) return std::nullopt;
  return nearest.pose;
}

tl::unexpected<Error> NoMatch(const Trajectory& sparse, const Trajectory& dense,
                              const AssociationOptions& options) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const StampedPose& p : sparse) {
    smallest = std::min(smallest, SecondsApart(dense[NearestIndex(dense, p.stamp)].stamp, p.stamp));
  }
  return MakeError(kKind,
                   "none of {} poses has a partner among {}: the nearest stamps are {:.4f} s "
                   "apart, allowed are {:.4f} s "
                   "(or interpolation over gaps of at most {:.2f} s). Likely cause: sparse "
                   "trajectories or a clock "
                   "offset; raise --max-difference or --max-gap, or give --time-offset",
                   sparse.size(), dense.size(), smallest, options.max_difference, options.max_gap);
}

bool HaveRotations(const Trajectory& trajectory) {
  return std::all_of(trajectory.begin(), trajectory.end(),
                     [](const StampedPose& p) { return p.has_rotation; });
}

Eigen::Isometry3d ToIsometry(const Pose3& pose) { return Eigen::Isometry3d(pose.matrix()); }

}  // namespace

Expected<MatchedPoses> Associate(const Trajectory& estimate, const Trajectory& truth,
                                 const AssociationOptions& options) {
  const auto sorted_estimate = Sorted(estimate, "estimate", options.estimate_offset);
  if (!sorted_estimate) return tl::unexpected(sorted_estimate.error());
  const auto sorted_truth = Sorted(truth, "truth", Duration());
  if (!sorted_truth) return tl::unexpected(sorted_truth.error());
  const Duration slack = Duration::FromSeconds(options.max_difference);
  if (auto overlap = CheckOverlap(*sorted_estimate, *sorted_truth, slack); !overlap) {
    return tl::unexpected(overlap.error());
  }
  const bool estimate_is_sparse = estimate.size() <= truth.size();
  const Trajectory& sparse = estimate_is_sparse ? *sorted_estimate : *sorted_truth;
  const Trajectory& dense = estimate_is_sparse ? *sorted_truth : *sorted_estimate;
  MatchedPoses matched{.estimate_count = estimate.size(), .truth_count = truth.size()};
  for (const StampedPose& p : sparse) {
    const std::optional<Pose3> partner = Partner(dense, p.stamp, options);
    if (!partner) continue;
    matched.stamps.push_back(p.stamp);
    matched.estimate.push_back(ToIsometry(estimate_is_sparse ? p.pose : *partner));
    matched.truth.push_back(ToIsometry(estimate_is_sparse ? *partner : p.pose));
  }
  if (matched.stamps.empty()) return NoMatch(sparse, dense, options);
  matched.has_rotations = HaveRotations(estimate) && HaveRotations(truth);
  return matched;
}

Expected<MatchedPoses> AssociateByIndex(const PoseMatrices& estimate, const PoseMatrices& truth) {
  if (estimate.empty()) return MakeError(kKind, "the estimate holds no poses");
  if (estimate.size() != truth.size()) {
    return MakeError(kKind,
                     "{} poses in the estimate, {} in the truth: without stamps both files must "
                     "describe the same "
                     "frames, one by one; use files with stamps",
                     estimate.size(), truth.size());
  }
  return MatchedPoses{.estimate = estimate,
                      .truth = truth,
                      .estimate_count = estimate.size(),
                      .truth_count = truth.size()};
}

}  // namespace mlvi

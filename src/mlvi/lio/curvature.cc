// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/curvature.h"

#include <algorithm>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

constexpr int kHalfWindow = 5;
constexpr int kSectors = 6;
constexpr int kEdgesPerSector = 20;
constexpr float kEdgeRatio = 0.25F, kPlaneRatio = 0.1F;
constexpr float kEdgeSigmas = 4.0F, kPlaneSigmas = 2.0F;
constexpr float kJump = 0.3F;      // m between neighbours of a ring
constexpr float kGrazing = 0.02F;  // of the range, to both neighbours
constexpr float kAzimuthGapSteps = 3.0F;

enum class Kind : std::uint8_t { kNone, kEdge, kPlane };

// One ring in firing order.
struct Ring {
  std::vector<std::size_t> index;  // into the deskewed points
  std::vector<float> range;        // m, as measured
  std::vector<float> sharpness;    // d / L
  std::vector<Kind> kind;
};

std::vector<Ring> SplitIntoRings(const DeskewedSweep& deskewed, const LidarSweep& sweep) {
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < deskewed.points.size(); ++i) {
    const std::size_t ring = sweep.points[deskewed.sources[i]].ring;
    if (ring >= rings.size()) rings.resize(ring + 1);
    rings[ring].index.push_back(i);
  }
  return rings;
}

// By firing time; without times by azimuth (either way round, curvature is symmetric).
void SortByFiring(const DeskewedSweep& deskewed, const LidarSweep& sweep, Ring& ring) {
  const auto point = [&](std::size_t i) -> const LidarPoint& {
    return sweep.points[deskewed.sources[i]];
  };
  const auto azimuth = [&](std::size_t i) {
    return std::atan2(point(i).position.y(), point(i).position.x());
  };
  const auto before = [&](std::size_t a, std::size_t b) {
    return sweep.has_times ? point(a).offset_ns < point(b).offset_ns : azimuth(a) < azimuth(b);
  };
  if (!std::is_sorted(ring.index.begin(), ring.index.end(), before)) {
    std::stable_sort(ring.index.begin(), ring.index.end(), before);
  }
}

// Points whose window is whole: no gap in azimuth, not in the shadow of a jump, not grazing.
std::vector<bool> Usable(const DeskewedSweep& deskewed, const LidarSweep& sweep, const Ring& ring) {
  const int n = static_cast<int>(ring.index.size());
  std::vector<bool> usable(n, true);
  const auto direction = [&](int i) {
    return Eigen::Vector3f(sweep.points[deskewed.sources[ring.index[i]]].position / ring.range[i]);
  };
  std::vector<float> steps(n - 1);
  for (int i = 0; i + 1 < n; ++i) steps[i] = (direction(i + 1) - direction(i)).norm();
  std::vector<float> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  const float gap = kAzimuthGapSteps * sorted[sorted.size() / 2];
  const auto rule_out = [&](int first, int last) {
    for (int i = std::max(first, 0); i <= std::min(last, n - 1); ++i) usable[i] = false;
  };
  for (int i = 0; i + 1 < n; ++i) {
    const float rise = ring.range[i + 1] - ring.range[i];
    if (steps[i] > gap)
      rule_out(i - kHalfWindow + 1, i + kHalfWindow);
    else if (rise > kJump)
      rule_out(i + 1, i + 1 + kHalfWindow);
    else if (rise < -kJump)
      rule_out(i - kHalfWindow, i);
    if (i == 0) continue;
    const float limit = kGrazing * ring.range[i];
    if (std::abs(rise) > limit && std::abs(ring.range[i] - ring.range[i - 1]) > limit)
      usable[i] = false;
  }
  rule_out(0, kHalfWindow - 1);
  rule_out(n - kHalfWindow, n - 1);
  return usable;
}

void Classify(const DeskewedSweep& deskewed, const std::vector<bool>& usable, float sigma,
              Ring& ring) {
  const int n = static_cast<int>(ring.index.size());
  for (int i = kHalfWindow; i < n - kHalfWindow; ++i) {
    if (!usable[i]) continue;
    const auto point = [&](int j) -> const Eigen::Vector3f& {
      return deskewed.points[ring.index[j]];
    };
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int j = 1; j <= kHalfWindow; ++j)
      sum += (point(i - j) - point(i)) + (point(i + j) - point(i));
    const float d = sum.norm() / (2 * kHalfWindow);
    const float length = 0.5F * ((point(i - kHalfWindow) - point(i)).norm() +
                                 (point(i + kHalfWindow) - point(i)).norm());
    ring.sharpness[i] = d / length;
    if (d > kEdgeRatio * length && d > kEdgeSigmas * sigma)
      ring.kind[i] = Kind::kEdge;
    else if (d < kPlaneRatio * length + kPlaneSigmas * sigma)
      ring.kind[i] = Kind::kPlane;
  }
}

// The sharpest of the edge points in [begin, end), none within the window of another.
void PickEdges(const Ring& ring, int begin, int end, std::vector<std::size_t>& edges) {
  std::vector<int> candidates;
  for (int i = begin; i < end; ++i) {
    if (ring.kind[i] == Kind::kEdge) candidates.push_back(i);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](int a, int b) { return ring.sharpness[a] > ring.sharpness[b]; });
  std::vector<int> picked;
  for (const int candidate : candidates) {
    const bool taken = std::any_of(picked.begin(), picked.end(), [&](int other) {
      return std::abs(other - candidate) <= kHalfWindow;
    });
    if (taken) continue;
    picked.push_back(candidate);
    edges.push_back(ring.index[candidate]);
    if (picked.size() == kEdgesPerSector) return;
  }
}

CurvatureFeatures OfRing(const DeskewedSweep& deskewed, const LidarSweep& sweep, float sigma,
                         Ring& ring) {
  CurvatureFeatures features;
  const int n = static_cast<int>(ring.index.size());
  if (n < 4 * kHalfWindow) return features;
  SortByFiring(deskewed, sweep, ring);
  for (const std::size_t i : ring.index) {
    ring.range.push_back(sweep.points[deskewed.sources[i]].position.norm());
  }
  ring.sharpness.assign(n, 0.0F);
  ring.kind.assign(n, Kind::kNone);
  Classify(deskewed, Usable(deskewed, sweep, ring), sigma, ring);
  for (int s = 0; s < kSectors; ++s)
    PickEdges(ring, n * s / kSectors, n * (s + 1) / kSectors, features.edges);
  for (int i = 0; i < n; ++i) {
    if (ring.kind[i] == Kind::kPlane) features.planes.push_back(ring.index[i]);
  }
  return features;
}

}  // namespace

CurvatureFeatures FindEdgesAndPlanes(const DeskewedSweep& deskewed, const LidarSweep& sweep,
                                     double range_noise) {
  MLVI_CHECK(sweep.has_rings, "a sweep of {} points without rings", sweep.points.size());
  std::vector<Ring> rings = SplitIntoRings(deskewed, sweep);
  std::vector<CurvatureFeatures> parts(rings.size());
  ParallelFor(rings.size(), 1, [&](std::size_t r) {
    parts[r] = OfRing(deskewed, sweep, static_cast<float>(range_noise), rings[r]);
  });
  CurvatureFeatures features;
  for (const CurvatureFeatures& part : parts) {
    features.edges.insert(features.edges.end(), part.edges.begin(), part.edges.end());
    features.planes.insert(features.planes.end(), part.planes.begin(), part.planes.end());
  }
  return features;
}

}  // namespace mlvi

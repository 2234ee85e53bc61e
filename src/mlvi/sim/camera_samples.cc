// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/camera_samples.h"

#include <algorithm>

#include "mlvi/base/error.h"

namespace mlvi::internal {
namespace {

// Base b digits of i mirrored at the point: evenly spread in [0, 1) (van der Corput).
double RadicalInverse(int i, int base) {
  double result = 0.0, digit = 1.0;
  for (; i > 0; i /= base) {
    digit /= base;
    result += digit * (i % base);
  }
  return result;
}

Eigen::Vector3f PlaceOf(const PixelSample& sample) {
  return {sample.dx, sample.dy, static_cast<float>(sample.time)};
}

}  // namespace

std::vector<PixelSample> FewSamples() {
  // Sixteenths of the exposure and of a pixel. Each number is taken once: eight rooks. The order in
  // time is that of least correlation with x and y, of all eight and of the first four.
  constexpr std::array<std::array<int, 3>, kFewSamples> kSamples = {{{-3, 7, -7},
                                                                     {-7, -7, -1},
                                                                     {3, 3, 7},
                                                                     {7, -3, -5},
                                                                     {5, 1, -3},
                                                                     {1, -1, 3},
                                                                     {-5, 5, 1},
                                                                     {-1, -5, 5}}};
  std::vector<PixelSample> samples;
  for (const auto& [time, x, y] : kSamples) {
    samples.push_back({.time = time / 16.0,
                       .dx = static_cast<float>(x) / 16.0F,
                       .dy = static_cast<float>(y) / 16.0F});
  }
  return samples;
}

std::vector<PixelSample> ManySamples() {
  std::vector<PixelSample> samples;
  constexpr auto kCount = static_cast<double>(kManySamples);
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();
  for (int i = 0; i < static_cast<int>(kManySamples); ++i) {
    samples.push_back({.time = (i + 0.5) / kCount - 0.5,
                       .dx = static_cast<float>(RadicalInverse(i + 1, 2) - 0.5),
                       .dy = static_cast<float>(RadicalInverse(i + 1, 3) - 0.5)});
    middle += Eigen::Vector2f(samples.back().dx, samples.back().dy) / static_cast<float>(kCount);
  }
  for (PixelSample& s : samples) {
    s.dx = std::clamp(s.dx - middle.x(), -0.5F, 0.5F);
    s.dy = std::clamp(s.dy - middle.y(), -0.5F, 0.5F);
  }
  return samples;
}

void GroupBySurface(std::span<const Sight> sights, const std::vector<PixelSample>& samples,
                    std::vector<SampleGroup>& groups) {
  MLVI_CHECK(sights.size() <= std::min(samples.size(), kManySamples), "{} sights of {} samples",
             sights.size(), samples.size());
  groups.clear();
  std::array<bool, kManySamples> taken{};
  for (std::size_t g = 0; g < sights.size(); ++g) {
    if (taken[g]) continue;
    std::array<std::size_t, kManySamples> members;
    std::size_t count = 0;
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    for (std::size_t k = g; k < sights.size(); ++k) {
      if (taken[k] || !SameSurface(sights[g], sights[k])) continue;
      taken[k] = true;
      members[count++] = k;
      middle += PlaceOf(samples[k]);
    }
    middle /= static_cast<float>(count);
    const auto nearer = [&](std::size_t a, std::size_t b) {
      return (PlaceOf(samples[a]) - middle).squaredNorm() <
             (PlaceOf(samples[b]) - middle).squaredNorm();
    };
    groups.push_back({.sample = *std::min_element(members.begin(), members.begin() + count, nearer),
                      .share = static_cast<float>(count) / static_cast<float>(sights.size())});
  }
}

}  // namespace mlvi::internal

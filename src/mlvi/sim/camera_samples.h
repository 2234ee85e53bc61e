// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The rays that make a pixel that an edge lies in or sweeps over.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "mlvi/sim/scene_renderer.h"

namespace mlvi::internal {

// Where in the pixel and when in the exposure a ray lies.
struct PixelSample {
  double time = 0.0;           // share of the exposure, in (-0.5, 0.5)
  float dx = 0.0F, dy = 0.0F;  // px, from the middle of the pixel
};

// Even over the pixel and over the exposure, and so that neither way across the pixel goes with
// time; their mean is the middle of both: no shift of edges.
constexpr std::size_t kFewSamples = 8;
constexpr std::size_t kFirstSamples = 4;  // of the few: even by themselves
constexpr std::size_t kManySamples = 16;
std::vector<PixelSample> FewSamples();
std::vector<PixelSample> ManySamples();

// Samples of a pixel that met the same surface.
struct SampleGroup {
  std::size_t sample = 0;  // the one nearest to their middle, in the pixel and the exposure
  float share = 0.0F;      // of all samples
};

// Replaces `groups`. `sights`: of `samples`, not more than kManySamples.
void GroupBySurface(std::span<const Sight> sights, const std::vector<PixelSample>& samples,
                    std::vector<SampleGroup>& groups);

}  // namespace mlvi::internal

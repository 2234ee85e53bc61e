// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr float kOne = 65535.0F;

std::uint16_t Encode(float reflectance) {
  return static_cast<std::uint16_t>(std::lround(kOne * std::clamp(reflectance, 0.0F, 1.0F)));
}

// Four channels at once: this is where a renderer spends its time. (Vector types of GCC and Clang,
// which widen integers one by one where they are not told otherwise.)
using Floats = float __attribute__((vector_size(16)));

Floats Load(const std::uint16_t* texel) {
#if defined(__SSE2__)
  const __m128i channels = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(texel));
  return _mm_cvtepi32_ps(_mm_unpacklo_epi16(channels, _mm_setzero_si128()));
#else
  return {static_cast<float>(texel[0]), static_cast<float>(texel[1]), static_cast<float>(texel[2]),
          0.0F};
#endif
}

// Of numbers that fit an int; std::floor is a call of the library on x86-64 without SSE 4.1.
int FloorOf(float x) {
  const int truncated = static_cast<int>(x);
  return truncated - (x < static_cast<float>(truncated) ? 1 : 0);
}

struct Level {
  const std::uint16_t* texels;
  int side;
};

Floats Bilinear(const Level& level, float u, float v) {
  const int mask = level.side - 1;
  const auto side = static_cast<float>(level.side);
  const float x = u * side - 0.5F, y = v * side - 0.5F;
  const int floor_x = FloorOf(x), floor_y = FloorOf(y);
  const float fx = x - static_cast<float>(floor_x), fy = y - static_cast<float>(floor_y);
  const int x0 = floor_x & mask, y0 = floor_y & mask;
  const int x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  const auto at = [&](int column, int row) {
    return Load(level.texels + 4 * (row * level.side + column));
  };
  return ((1.0F - fx) * (1.0F - fy)) * at(x0, y0) + (fx * (1.0F - fy)) * at(x1, y0) +
         ((1.0F - fx) * fy) * at(x0, y1) + (fx * fy) * at(x1, y1);
}

// The next level of a pyramid.
std::vector<Eigen::Vector3f> Halved(const std::vector<Eigen::Vector3f>& texels, std::size_t size) {
  const std::size_t half = size / 2;
  std::vector<Eigen::Vector3f> result(half * half);
  for (std::size_t row = 0; row < half; ++row) {
    for (std::size_t column = 0; column < half; ++column) {
      const std::size_t above = 2 * row * size + 2 * column, below = above + size;
      result[row * half + column] =
          0.25F * (texels[above] + texels[above + 1] + texels[below] + texels[below + 1]);
    }
  }
  return result;
}

}  // namespace

std::string_view NameOf(TexturePattern pattern) {
  constexpr std::array<std::string_view, 20> kNames = {
      "plain",   "plaster",    "concrete", "brick",   "stone blocks", "paving", "tiles",
      "asphalt", "rock",       "grass",    "foliage", "bark",         "wood",   "carpet",
      "metal",   "roof tiles", "gravel",   "posters", "shelves",      "fabric"};
  return kNames.at(static_cast<std::size_t>(pattern));
}

Texture::Texture(int size, const std::vector<Eigen::Vector3f>& texels) : size_(size) {
  MLVI_CHECK(size > 0 && (size & (size - 1)) == 0, "a texture of {} texels a side", size);
  auto side = static_cast<std::size_t>(size);
  MLVI_CHECK(texels.size() == side * side, "{} texels for a side of {}", texels.size(), size);
  std::vector<Eigen::Vector3f> level = texels;
  while (true) {
    offsets_.push_back(values_.size());
    for (const Eigen::Vector3f& t : level)
      values_.insert(values_.end(), {Encode(t.x()), Encode(t.y()), Encode(t.z()), 0});
    if (side == 1) break;
    level = Halved(level, side);
    side /= 2;
  }
}

Eigen::Vector3f Texture::Mean(const Eigen::Vector2f& uv, const Eigen::Vector2f& stretch, int taps,
                              float lod) const {
  lod = std::clamp(lod, 0.0F, static_cast<float>(levels() - 1));
  const int fine = static_cast<int>(lod);
  const float coarse_share = lod - static_cast<float>(fine);
  const auto level = [&](int index) {
    return Level{values_.data() + offsets_[static_cast<std::size_t>(index)], size_ >> index};
  };
  const float step = 1.0F / static_cast<float>(taps);
  Floats sum = {};
  for (int i = 0; i < taps; ++i) {
    const float offset = (static_cast<float>(i) + 0.5F) * step - 0.5F;
    float u = uv.x() + offset * stretch.x(), v = uv.y() + offset * stretch.y();
    // Towards 0, so that the index does not overflow far from the origin.
    u -= static_cast<float>(FloorOf(u));
    v -= static_cast<float>(FloorOf(v));
    sum += (1.0F - coarse_share) * Bilinear(level(fine), u, v);
    if (coarse_share > 0.0F) sum += coarse_share * Bilinear(level(fine + 1), u, v);
  }
  sum *= step / kOne;
  return {sum[0], sum[1], sum[2]};
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif
#if defined(__linux__)
#include <sys/mman.h>
#endif

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr float kOne = 65535.0F;

std::uint16_t Encoded(float reflectance) {
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

// Two neighbours in each of two rows: (a[0], a[1], b[0], b[1]).
Floats LoadPairs(const std::uint16_t* a, const std::uint16_t* b) {
#if defined(__SSE2__)
  std::uint32_t first, second;
  std::memcpy(&first, a, sizeof(first));
  std::memcpy(&second, b, sizeof(second));
  const __m128i all = _mm_unpacklo_epi32(_mm_cvtsi32_si128(static_cast<int>(first)),
                                         _mm_cvtsi32_si128(static_cast<int>(second)));
  return _mm_cvtepi32_ps(_mm_unpacklo_epi16(all, _mm_setzero_si128()));
#else
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(b[0]),
          static_cast<float>(b[1])};
#endif
}

struct Level {
  const std::uint16_t* texels;
  int side;
};

// A place between four texels, and their weights.
struct Tap {
  int x0, y0, x1, y1;
  float fx, fy;

  Tap(const Level& level, float u, float v) {
    const int mask = level.side - 1;
    const auto side = static_cast<float>(level.side);
    const float x = u * side - 0.5F, y = v * side - 0.5F;
    const int floor_x = FloorOf(x), floor_y = FloorOf(y);
    fx = x - static_cast<float>(floor_x), fy = y - static_cast<float>(floor_y);
    x0 = floor_x & mask, y0 = floor_y & mask;
    x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  }
};

// Of a level of colours: the colours.
struct ColourLevel : Level {
  Floats Bilinear(float u, float v) const {
    const Tap tap(*this, u, v);
    const float fx = tap.fx, fy = tap.fy;
    const auto at = [&](int column, int row) { return Load(texels + 4 * (row * side + column)); };
    return ((1.0F - fx) * (1.0F - fy)) * at(tap.x0, tap.y0) +
           (fx * (1.0F - fy)) * at(tap.x1, tap.y0) + ((1.0F - fx) * fy) * at(tap.x0, tap.y1) +
           (fx * fy) * at(tap.x1, tap.y1);
  }
  static Eigen::Vector3f ColourOf(const Floats& sum) { return {sum[0], sum[1], sum[2]}; }
};

// Of a grey level: the shares of the four texels, which are added up in the end only.
struct GreyLevel : Level {
  Floats Bilinear(float u, float v) const {
    const Tap tap(*this, u, v);
    const float fx = tap.fx, fy = tap.fy;
    const Floats x = {1.0F - fx, fx, 1.0F - fx, fx}, y = {1.0F - fy, 1.0F - fy, fy, fy};
    const auto row = [&](int index) { return texels + index * (side + 1) + tap.x0; };
    return x * y * LoadPairs(row(tap.y0), row(tap.y1));
  }
  static Eigen::Vector3f ColourOf(const Floats& sum) {
    return Eigen::Vector3f::Constant((sum[0] + sum[1]) + (sum[2] + sum[3]));
  }
};

// The mean of samples along a line between two levels of a pyramid.
template <typename Level>
Eigen::Vector3f MeanAlong(const Level& fine, const Level& coarse, float coarse_share,
                          const Eigen::Vector2f& uv, const Eigen::Vector2f& stretch, int taps) {
  const float step = 1.0F / static_cast<float>(taps);
  Floats sum = {};
  for (int i = 0; i < taps; ++i) {
    const float offset = (static_cast<float>(i) + 0.5F) * step - 0.5F;
    float u = uv.x() + offset * stretch.x(), v = uv.y() + offset * stretch.y();
    // Towards 0, so that the index does not overflow far from the origin.
    u -= static_cast<float>(FloorOf(u));
    v -= static_cast<float>(FloorOf(v));
    sum += (1.0F - coarse_share) * fine.Bilinear(u, v);
    if (coarse_share > 0.0F) sum += coarse_share * coarse.Bilinear(u, v);
  }
  return Level::ColourOf(sum * (step / kOne));
}

// The next level of a pyramid.
template <typename Channels>
std::vector<Channels> Halved(const std::vector<Channels>& texels, std::size_t size) {
  const std::size_t half = size / 2;
  std::vector<Channels> result(half * half);
  for (std::size_t row = 0; row < half; ++row) {
    for (std::size_t column = 0; column < half; ++column) {
      const std::size_t above = 2 * row * size + 2 * column, below = above + size;
      result[row * half + column] =
          0.25F * (texels[above] + texels[above + 1] + texels[below] + texels[below + 1]);
    }
  }
  return result;
}

void EncodeRow(std::span<const Eigen::Vector3f> row, std::vector<std::uint16_t>& values) {
  for (const Eigen::Vector3f& t : row)
    values.insert(values.end(), {Encoded(t.x()), Encoded(t.y()), Encoded(t.z()), 0});
}
void EncodeRow(std::span<const float> row, std::vector<std::uint16_t>& values) {
  for (const float t : row) values.push_back(Encoded(t));
  values.push_back(Encoded(row.front()));
}

// Textures are read all over the place: in large pages where the system has them.
void ReserveInLargePages(std::size_t size, std::vector<std::uint16_t>& values) {
  values.reserve(size);
#if defined(__linux__)
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(values.data()) + kPage - 1) & ~(kPage - 1);
  const auto end = reinterpret_cast<std::uintptr_t>(values.data() + size) & ~(kPage - 1);
  // A hint: what comes of it does not matter.
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

}  // namespace

std::string_view NameOf(TexturePattern pattern) {
  constexpr std::array<std::string_view, 20> kNames = {
      "plain",   "plaster",    "concrete", "brick",   "stone blocks", "paving", "tiles",
      "asphalt", "rock",       "grass",    "foliage", "bark",         "wood",   "carpet",
      "metal",   "roof tiles", "gravel",   "posters", "shelves",      "fabric"};
  return kNames.at(static_cast<std::size_t>(pattern));
}

Texture::Texture(int size, const std::vector<Eigen::Vector3f>& texels, TextureTint tint)
    : size_(size), tint_(tint) {
  MLVI_CHECK(size > 0 && (size & (size - 1)) == 0, "a texture of {} texels a side", size);
  const auto side = static_cast<std::size_t>(size);
  MLVI_CHECK(texels.size() == side * side, "{} texels for a side of {}", texels.size(), size);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& t : texels) sum += t.cast<double>();
  sum /= static_cast<double>(texels.size());
  mean_ = static_cast<float>(sum.cwiseMax(0.0).cwiseMin(1.0).mean());
  if (tint == TextureTint::kColour) {
    Encode(texels);
    return;
  }
  std::vector<float> grey(texels.size());
  std::ranges::transform(texels, grey.begin(),
                         [](const Eigen::Vector3f& t) { return kLuminanceWeights.dot(t); });
  Encode(std::move(grey));
}

template <typename Channels>
void Texture::Encode(std::vector<Channels> level) {
  ReserveInLargePages((tint_ == TextureTint::kGrey ? 2 : 6) * level.size() + 8, values_);
  for (auto side = static_cast<std::size_t>(size_);; side /= 2) {
    offsets_.push_back(values_.size());
    for (std::size_t row = 0; row < side; ++row)
      EncodeRow(std::span<const Channels>(level).subspan(row * side, side), values_);
    if (side == 1) break;
    level = Halved(level, side);
  }
}

Eigen::Vector3f Texture::Mean(const Eigen::Vector2f& uv, const Eigen::Vector2f& stretch, int taps,
                              float lod) const {
  lod = std::clamp(lod, 0.0F, static_cast<float>(levels() - 1));
  const int fine = static_cast<int>(lod), coarse = std::min(fine + 1, levels() - 1);
  const float coarse_share = lod - static_cast<float>(fine);
  const auto level = [&](int index) {
    return Level{values_.data() + offsets_[static_cast<std::size_t>(index)], size_ >> index};
  };
  if (tint_ == TextureTint::kGrey) {
    return MeanAlong(GreyLevel{level(fine)}, GreyLevel{level(coarse)}, coarse_share, uv, stretch,
                     taps);
  }
  return MeanAlong(ColourLevel{level(fine)}, ColourLevel{level(coarse)}, coarse_share, uv, stretch,
                   taps);
}

}  // namespace mlvi

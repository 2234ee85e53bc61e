// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "mlvi/base/error.h"

namespace mlvi {
namespace {

constexpr float kOne = 65535.0F;

std::uint16_t Encode(float reflectance) {
  return static_cast<std::uint16_t>(std::lround(kOne * std::clamp(reflectance, 0.0F, 1.0F)));
}

// Four channels at once: this is where a renderer spends its time. (Vector types of GCC and Clang.)
using Floats = float __attribute__((vector_size(16)));
using Shorts = std::uint16_t __attribute__((vector_size(8)));

Floats Load(const std::uint16_t* texel) {
  Shorts channels;
  std::memcpy(&channels, texel, sizeof(channels));
  return __builtin_convertvector(channels, Floats);
}

// Of numbers that fit an int; std::floor is a call of the library on x86-64 without SSE 4.1.
int FloorOf(float x) {
  const int truncated = static_cast<int>(x);
  return truncated - (x < static_cast<float>(truncated) ? 1 : 0);
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

Eigen::Vector3f Texture::Bilinear(float u, float v, int level) const {
  const int side = size_ >> level, mask = side - 1;
  const float x = u * static_cast<float>(side) - 0.5F, y = v * static_cast<float>(side) - 0.5F;
  const int floor_x = FloorOf(x), floor_y = FloorOf(y);
  const float fx = x - static_cast<float>(floor_x), fy = y - static_cast<float>(floor_y);
  const int x0 = floor_x & mask, y0 = floor_y & mask;
  const int x1 = (x0 + 1) & mask, y1 = (y0 + 1) & mask;
  const std::uint16_t* texels = values_.data() + offsets_[static_cast<std::size_t>(level)];
  const auto at = [&](int column, int row) { return Load(texels + 4 * (row * side + column)); };
  const Floats above = (1.0F - fx) * at(x0, y0) + fx * at(x1, y0);
  const Floats below = (1.0F - fx) * at(x0, y1) + fx * at(x1, y1);
  const Floats result = (1.0F / kOne) * ((1.0F - fy) * above + fy * below);
  return {result[0], result[1], result[2]};
}

Eigen::Vector3f Texture::Sample(float u, float v, float lod) const {
  // Towards 0, so that the index does not overflow far from the origin.
  u -= static_cast<float>(FloorOf(u));
  v -= static_cast<float>(FloorOf(v));
  lod = std::clamp(lod, 0.0F, static_cast<float>(levels() - 1));
  const int fine = static_cast<int>(lod);
  const float share = lod - static_cast<float>(fine);
  if (share == 0.0F) return Bilinear(u, v, fine);
  return (1.0F - share) * Bilinear(u, v, fine) + share * Bilinear(u, v, fine + 1);
}

}  // namespace mlvi

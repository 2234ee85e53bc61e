// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Noise on the unit square that repeats without a seam: what textures are drawn from.
#pragma once

#include <cmath>
#include <cstdint>

namespace mlvi::internal {

// Every function takes u, v in [0, 1), a number of cells a side (>= 1) and a salt: different salts
// give independent noise.
class TileNoise {
 public:
  explicit TileNoise(std::uint64_t seed) : seed_(static_cast<std::uint32_t>(seed ^ (seed >> 32))) {}

  // Uniform in [0, 1), one value per cell (column, row), which wrap around.
  float Cell(int column, int row, int columns, int rows, std::uint32_t salt) const {
    column = Wrapped(column, columns);
    row = Wrapped(row, rows);
    std::uint32_t h = seed_ ^ (static_cast<std::uint32_t>(column) * 0x8da6b343U) ^
                      (static_cast<std::uint32_t>(row) * 0xd8163841U) ^ (salt * 0xcb1ab31fU);
    h = (h ^ (h >> 16)) * 0x7feb352dU;
    h = (h ^ (h >> 15)) * 0x846ca68bU;
    return static_cast<float>((h ^ (h >> 16)) >> 8) * 0x1.0p-24F;
  }

  // Value noise in [0, 1], smooth, `columns` x `rows` cells.
  float Value(float u, float v, int columns, int rows, std::uint32_t salt) const {
    const float x = u * static_cast<float>(columns), y = v * static_cast<float>(rows);
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const float a = Smooth(x - static_cast<float>(i)), b = Smooth(y - static_cast<float>(j));
    const auto at = [&](int di, int dj) { return Cell(i + di, j + dj, columns, rows, salt); };
    return (1 - b) * ((1 - a) * at(0, 0) + a * at(1, 0)) + b * ((1 - a) * at(0, 1) + a * at(1, 1));
  }

  // Sum of `octaves` of Value, each of twice the frequency and half the weight; in [0, 1], mean
  // 0.5.
  float Fractal(float u, float v, int columns, int rows, int octaves, std::uint32_t salt) const {
    float sum = 0.0F, weight = 0.5F, total = 0.0F;
    for (int k = 0; k < octaves; ++k) {
      sum += weight * Value(u, v, columns << k, rows << k, salt + static_cast<std::uint32_t>(k));
      total += weight;
      weight *= 0.5F;
    }
    return sum / total;
  }

  // Cellular noise (Worley 1996): distances to the nearest and the second nearest of one point per
  // cell, in cells, and a uniform number that the nearest one owns.
  struct Cellular {
    float first = 8.0F, second = 8.0F;
    float id = 0.0F;
    float dx = 0.0F, dy = 0.0F;  // from the nearest one, in cells
  };
  Cellular Points(float u, float v, int columns, int rows, std::uint32_t salt) const {
    const float x = u * static_cast<float>(columns), y = v * static_cast<float>(rows);
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    Cellular result;
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int c = i + di, r = j + dj;
        const float dx = x - (static_cast<float>(c) + Cell(c, r, columns, rows, salt));
        const float dy = y - (static_cast<float>(r) + Cell(c, r, columns, rows, salt + 1));
        const float distance = dx * dx + dy * dy;
        if (distance < result.first) {
          result.second = result.first;
          result.first = distance;
          result.id = Cell(c, r, columns, rows, salt + 2);
          result.dx = dx;
          result.dy = dy;
        } else if (distance < result.second) {
          result.second = distance;
        }
      }
    }
    result.first = std::sqrt(result.first);
    result.second = std::sqrt(result.second);
    return result;
  }

 private:
  // `i` modulo `n`, in [0, n): by bits where that will do, as divisions take the time of all the
  // rest.
  static int Wrapped(int i, int n) {
    if ((n & (n - 1)) == 0) return i & (n - 1);
    return ((i % n) + n) % n;
  }
  static float Smooth(float t) { return t * t * t * (t * (6.0F * t - 15.0F) + 10.0F); }

  std::uint32_t seed_;
};

}  // namespace mlvi::internal

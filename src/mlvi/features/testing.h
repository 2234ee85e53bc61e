// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Synthetic pictures whose grey values are known between pixels, too: for tests of what is measured
// to a fraction of one.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/sensors/measurements.h"

namespace mlvi::test {

// A sum of waves of random direction and phase, wavelengths between `shortest` and `longest` px
// with equal energy per octave, as natural pictures have; grey values 128 +- about 2 `contrast`.
// Band-limited, so sampling loses nothing.
class WaveTexture {
 public:
  explicit WaveTexture(std::uint64_t seed, double contrast = 40.0, double shortest = 5.0,
                       double longest = 120.0) {
    RandomStream random(seed, "texture");
    const double amplitude = contrast * std::sqrt(2.0 / kWaves);
    for (int i = 0; i < kWaves; ++i) {
      const double length = shortest * std::pow(longest / shortest, random.Uniform());
      const double direction = 2.0 * std::numbers::pi * random.Uniform();
      const double wave_number = 2.0 * std::numbers::pi / length;
      waves_.push_back({wave_number * std::cos(direction), wave_number * std::sin(direction),
                        2.0 * std::numbers::pi * random.Uniform(), amplitude});
    }
  }
  double operator()(const Eigen::Vector2d& p) const {
    double value = 128.0;
    for (const Wave& w : waves_)
      value += w.amplitude * std::sin(w.kx * p.x() + w.ky * p.y() + w.phase);
    return value;
  }

 private:
  struct Wave {
    double kx, ky, phase, amplitude;
  };
  static constexpr int kWaves = 60;
  std::vector<Wave> waves_;
};

// The image in which pixel p shows texture(source(p)), with white noise (grey values, one sigma).
template <typename Texture>
Image Render(int width, int height, const Texture& texture,
             const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& source, double noise,
             RandomStream random) {
  Image image{.width = width, .height = height};
  image.pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double value = texture(source({x, y})) + noise * random.Normal();
      image.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)));
    }
  }
  return image;
}

}  // namespace mlvi::test

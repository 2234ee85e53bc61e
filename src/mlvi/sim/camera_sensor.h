// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mlvi/base/random.h"
#include "mlvi/base/time.h"

namespace mlvi {

// Lens, image sensor and its electronics. The defaults describe a global-shutter sensor of 6.9 um
// pixels (Sony IMX287, as in the Alphasense rigs) behind an f/2.4 fisheye:
//   electrons = L * lens_gain * vignette * exposure * electrons_per_lux_second,
// plus shot noise (variance = electrons) and read noise; signal = electrons * gain / full_well,
// clipped to [0, 1]; grey value = 255 signal^(1 / gamma).
struct CameraPhysics {
  double lens_gain = 0.123;  // lux on the sensor per cd/m^2 in the scene: 0.9 pi / (4 * 2.4^2)
  double electrons_per_lux_second = 1.1e5;
  double full_well = 10000.0;      // electrons that give white at gain 1
  double read_noise = 5.0;         // electrons, one sigma
  double gamma = 2.2;              // 1: linear
  double corner_brightness = 0.3;  // of the farthest corner, relative to the principal point
  double min_exposure = 20e-6;     // s
  double max_exposure = 10e-3;     // s; then gain rises
  double max_gain = 16.0;
  double target_grey = 95.0;   // mean grey value that exposure control aims at
  double exposure_lag = 0.25;  // s, time constant of exposure control
  Duration row_time;           // rolling shutter: from one row to the next; 0: global
  bool colour = false;         // blue, green, red; else grey
};

struct Exposure {
  double seconds = 1e-3;
  double gain = 1.0;
};

// From luminance to grey values.
class CameraSensor {
 public:
  explicit CameraSensor(const CameraPhysics& physics);

  const CameraPhysics& physics() const { return physics_; }

  // Grey value of a pixel in [0, 255] without noise, not rounded. `luminance` in cd/m^2, after
  // vignetting.
  double Expected(double luminance, const Exposure& exposure) const;
  // With noise, rounded.
  std::uint8_t Expose(double luminance, const Exposure& exposure, RandomStream& random) const;

  // One exposure and gain for a product of both, s: the gain rises where the exposure ends.
  Exposure Split(double exposure_times_gain) const;

 private:
  double Signal(double electrons, double gain) const {
    return electrons * gain / physics_.full_well;
  }
  double Grey(double signal) const;
  double Normal(RandomStream& random) const;

  CameraPhysics physics_;
  std::vector<float> curve_;    // grey values over the square root of the signal
  std::vector<float> normals_;  // quantiles of the normal distribution
};

}  // namespace mlvi

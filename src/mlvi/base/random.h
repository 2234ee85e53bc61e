// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Random numbers of the simulator and of tests: one named stream per sensor, explicit seeds, the
// same bits on every machine (the distributions of the standard library differ between
// implementations).
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace mlvi {

class RandomStream {
 public:
  // Streams with different names are independent, even for equal seeds.
  explicit RandomStream(std::uint64_t seed, std::string_view name = "") : state_(seed) {
    for (const char c : name) state_ = Mix(state_ ^ static_cast<unsigned char>(c));
    state_ = Mix(state_);
  }
  // A stream of its own for an element (a sweep, a column) of this one: results do not depend on
  // the order in which elements are drawn. Does not advance this stream.
  RandomStream Fork(std::uint64_t index) const { return RandomStream(Mix(state_ ^ Mix(index))); }

  std::uint64_t NextBits() { return Mix(state_ += 0x9e3779b97f4a7c15ULL); }
  // Uniform in [0, 1).
  double Uniform() { return static_cast<double>(NextBits() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // Normal with mean 0 and variance 1 (Box-Muller, one value per call).
  double Normal() {
    const double u = 1.0 - Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  // SplitMix64 (Steele, Lea and Flood 2014).
  static std::uint64_t Mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace mlvi

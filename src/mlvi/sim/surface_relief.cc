// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/surface_relief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "mlvi/base/random.h"
#include "mlvi/sim/averaged_relief.h"

namespace mlvi {
namespace {

constexpr int kSide = 16;         // lattice points per period and axis: 64 kB
constexpr double kLargest = 2.5;  // of lattice values before they are scaled by 1.03 at most
constexpr double kGrazing = 0.2;  // least cosine
constexpr double kExact = 2e-4;   // m
constexpr int kMostSteps = 20;

// The rms of lattice values of rms 1 joined by smoothsteps s along three axes: the mean of s^2 +
// (1 - s)^2 is 26/35 along each.
constexpr float kJoinedRms = 0.640262F;  // (26/35)^(3/2)

// Four rows of the lattice at once (vector types of GCC and Clang).
using Floats = float __attribute__((vector_size(16)));

std::size_t IndexOf(int x, int y, int z) {
  constexpr int kMask = kSide - 1;
  return static_cast<std::size_t>(((z & kMask) * kSide + (y & kMask)) * kSide + (x & kMask));
}

// Between the axes of the world and those of the lattice: no wall lies along its planes.
Eigen::Vector3d Aslant(const Eigen::Vector3d& p) {
  // The rotation of least repetition among 300 drawn: rational directions would repeat soon.
  return {0.285878 * p.x() + 0.849891 * p.y() - 0.442672 * p.z(),
          -0.820561 * p.x() + 0.455702 * p.y() + 0.344987 * p.z(),
          0.494928 * p.x() + 0.264615 * p.y() + 0.827662 * p.z()};
}

// Heights of bumps of that rms stay below.
double BoundOf(double rms) { return 1.03 * kLargest / kJoinedRms * rms; }

// Slopes along a ray stay below, but for a few in ten thousand places: four times their rms.
// Smoothsteps have slopes of rms sqrt(2.4 / (26/35)) per bump and rms of heights.
double SteepnessOf(double rms, double size) { return 4.0 * 1.797 * rms / size; }

// Where a function goes from negative to positive: narrowed by secants (Illinois).
struct Bracket {
  double low, high, at_low, at_high;
  int side = 0;  // of the end that moved last

  double Secant() const { return low - at_low * (high - low) / (at_high - at_low); }
  void Narrow(double s, double f) {
    if (f < 0.0) {
      low = s, at_low = f;
      if (side < 0) at_high *= 0.5;
    } else {
      high = s, at_high = f;
      if (side > 0) at_low *= 0.5;
    }
    side = f < 0.0 ? -1 : 1;
  }
};

struct Sample {
  double s, value;
};

// Where the parabola through three places, the middle one the lowest, is lowest.
double LowestBetween(const Sample& a, const Sample& b, const Sample& c) {
  const double left = (b.s - a.s) * (b.value - c.value), right = (b.s - c.s) * (b.value - a.value);
  return b.s - 0.5 * ((b.s - a.s) * left - (b.s - c.s) * right) / (left - right);
}

// Narrows the bracket to the first place, from its upper end, where f is negative: steps as far as
// a function of that `slope` stays positive, but at least `least`. Steps over the tip of a bump
// show by what they rise on its far side.
template <typename Function>
void FollowDown(const Function& f, double least, double slope, Bracket& bracket) {
  Sample before{bracket.high, f(bracket.high)}, last = before;
  while (last.s > bracket.low) {
    Sample next{.s = std::max(bracket.low, last.s - std::max(least, last.value / slope))};
    next.value = f(next.s);
    if (last.value < before.value && last.value < next.value) {
      Sample tip{.s = LowestBetween(before, last, next)};
      tip.value = f(tip.s);
      if (tip.value < 0.0) {
        if (tip.s > last.s) last = before;
        next = tip;
      }
    }
    before = last, last = next;
    if (last.value < 0.0) break;
  }
  bracket.high = before.s, bracket.at_high = before.value;
  bracket.low = last.s, bracket.at_low = last.value;
}

}  // namespace

double Relief::bound() const { return BoundOf(fine + coarse); }

// The covariance of heights is nearly exp(-r^2 / (2 l^2)) with l of 0.55 bumps: 0.556 by its
// curvature, 0.537 by its integral. A Gaussian window of deviation d along one direction leaves
// 1 / sqrt(1 + 2 d^2 / l^2) of the variance.
Relief AveragedRelief(const Relief& relief, double deviation, double cosine) {
  const double along = deviation / std::max(cosine, kGrazing);
  const auto left = [&](double size) {
    const double l2 = 0.5 * (0.55 * size) * (0.55 * size);
    const double variance2 = (1.0 + deviation * deviation / l2) * (1.0 + along * along / l2);
    return 1.0 / std::sqrt(std::sqrt(variance2));
  };
  if (deviation <= 0.0) return relief;
  Relief mean = relief;
  mean.fine *= left(relief.fine_size);
  mean.coarse *= left(relief.coarse_size);
  return mean;
}

SurfaceRelief::SurfaceRelief() : lattice_(kSide * kSide * kSide) {
  RandomStream random(1, "surface relief");
  std::vector<float> values(lattice_.size());
  double squares = 0.0;
  for (float& value : values) {
    value = static_cast<float>(std::clamp(random.Normal(), -kLargest, kLargest));
    squares += value * value;
  }
  const auto scale = static_cast<float>(std::sqrt(static_cast<double>(values.size()) / squares));
  for (float& value : values) value *= scale;
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        lattice_[IndexOf(x, y, z)] = {values[IndexOf(x, y, z)], values[IndexOf(x, y + 1, z)],
                                      values[IndexOf(x, y, z + 1)],
                                      values[IndexOf(x, y + 1, z + 1)]};
      }
    }
  }
}

// A ray in the lattice, as bumps of both sizes see it: it is at `fine` - s * `fine_step` after s m on
// the way back.
struct SurfaceRelief::Ray {
  Eigen::Vector3d fine, fine_step, coarse, coarse_step;

  Ray(const Relief& relief, const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d at = Aslant(point), step = Aslant(direction);
    fine = at / relief.fine_size;
    fine_step = step / relief.fine_size;
    // Elsewhere in the same lattice: not the same bumps made larger.
    coarse = at / relief.coarse_size + Eigen::Vector3d(11.3, 17.7, 5.1);
    coarse_step = step / relief.coarse_size;
  }
};

double SurfaceRelief::Noise(const Eigen::Vector3d& at) const {
  std::array<int, 3> cell{};
  std::array<float, 3> s{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = at[static_cast<Eigen::Index>(axis)];
    const int truncated = static_cast<int>(value);
    cell[axis] = truncated - (value < truncated ? 1 : 0);  // floor
    const auto t = static_cast<float>(value - cell[axis]);
    s[axis] = t * t * (3.0F - 2.0F * t);
  }
  const auto [x, y, z] = cell;
  const auto load = [&](int column) {
    Floats values;
    std::memcpy(&values, lattice_[IndexOf(column, y, z)].data(), sizeof(values));
    return values;
  };
  const Floats left = load(x), right = load(x + 1), rows = left + s[0] * (right - left);
  const float a = rows[0] + s[1] * (rows[1] - rows[0]), b = rows[2] + s[1] * (rows[3] - rows[2]);
  return (a + s[2] * (b - a)) / kJoinedRms;
}

double SurfaceRelief::FineOn(const Relief& relief, const Ray& ray, double s) const {
  return relief.fine > 0.0 ? relief.fine * Noise(ray.fine - s * ray.fine_step) : 0.0;
}
double SurfaceRelief::CoarseOn(const Relief& relief, const Ray& ray, double s) const {
  return relief.coarse > 0.0 ? relief.coarse * Noise(ray.coarse - s * ray.coarse_step) : 0.0;
}

double SurfaceRelief::HeightAt(const Relief& relief, const Eigen::Vector3d& point) const {
  const Ray ray(relief, point, Eigen::Vector3d::Zero());
  return FineOn(relief, ray, 0.0) + CoarseOn(relief, ray, 0.0);
}

// The largest root of f(s) = s cosine - h(point - s direction), which is positive where the ray is
// above the surface and negative within: between the bounds of heights. Where bumps are less steep
// than the ray, f grows all the way, much as s cosine, and has no other.
double SurfaceRelief::ShortensBy(const Relief& relief, const Eigen::Vector3d& point,
                                 const Eigen::Vector3d& direction, double cosine) const {
  if (relief.plane()) return 0.0;
  const double c = std::max(cosine, kGrazing), reach = relief.bound();
  const Ray ray(relief, point, direction);
  const auto above_waves = [&](double s) { return s * c - CoarseOn(relief, ray, s); };
  const auto above = [&](double s) { return above_waves(s) - FineOn(relief, ray, s); };
  Bracket root{.low = -reach / c, .high = reach / c, .at_low = -reach, .at_high = reach};
  const double waves = SteepnessOf(relief.coarse, relief.coarse_size),
               bumps = SteepnessOf(relief.fine, relief.fine_size),
               steepness = std::hypot(waves, bumps);
  double s = 0.0;
  if (steepness < c) {
    const double f = above(0.0);
    if (std::abs(f) < kExact) return 0.0;
    root.Narrow(0.0, f);
    s = -f / c;
    if (s <= root.low || s >= root.high) s = root.Secant();
  } else {
    const double least = 0.25 * (relief.fine > 0.0 ? relief.fine_size : relief.coarse_size);
    // Down to where fine bumps may be, then among them.
    Bracket above_bumps = root;
    FollowDown([&](double at) { return above_waves(at) - BoundOf(relief.fine); }, least, c + waves,
               above_bumps);
    root.high = above_bumps.high;
    FollowDown(above, least, c + steepness, root);
    s = root.Secant();
  }
  for (int step = 0; step < kMostSteps; ++step) {
    const double f = above(s);
    if (std::abs(f) < kExact) break;
    root.Narrow(s, f);
    s = root.Secant();
  }
  return s;
}

}  // namespace mlvi

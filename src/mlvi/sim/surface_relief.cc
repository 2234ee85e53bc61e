// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/surface_relief.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "mlvi/base/random.h"

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
  return {0.6 * p.x() + 0.64 * p.y() + 0.48 * p.z(), -0.8 * p.x() + 0.48 * p.y() + 0.36 * p.z(),
          -0.6 * p.y() + 0.8 * p.z()};
}

}  // namespace

double Relief::bound() const { return 1.03 * kLargest / kJoinedRms * (fine + coarse); }

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

// The root of f(s) = s cosine - h(point - s direction), which goes from negative to positive within
// the bound of heights. Nearly everywhere f grows as s cosine, so that the second step meets it; the
// others are secants within the bracket that they narrow (Illinois).
double SurfaceRelief::ShortensBy(const Relief& relief, const Eigen::Vector3d& point,
                                 const Eigen::Vector3d& direction, double cosine) const {
  if (relief.plane()) return 0.0;
  const double c = std::max(cosine, kGrazing), reach = relief.bound();
  const Ray ray(relief, point, direction);
  double low = -reach / c, high = reach / c, at_low = -reach, at_high = reach, s = 0.0;
  int side = 0;  // of the end that moved last
  for (int step = 0; step < kMostSteps; ++step) {
    const double f = s * c - FineOn(relief, ray, s) - CoarseOn(relief, ray, s);
    if (std::abs(f) < kExact) break;
    if (f < 0.0) {
      low = s, at_low = f;
      if (side < 0) at_high *= 0.5;
    } else {
      high = s, at_high = f;
      if (side > 0) at_low *= 0.5;
    }
    side = f < 0.0 ? -1 : 1;
    const double secant = low - at_low * (high - low) / (at_high - at_low), straight = s - f / c;
    s = step == 0 && straight > low && straight < high ? straight : secant;
  }
  return s;
}

}  // namespace mlvi

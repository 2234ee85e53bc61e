// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Generators of geometric values for property tests. They favour the hard ones: angles at zero,
// tiny, and at their bound.
#pragma once

#include <rapidcheck.h>

#include <cmath>
#include <cstdint>

#include "mlvi/geometry/pose3.h"

namespace mlvi::testing {

// Uniform in [low, high], independent of RapidCheck's size.
inline rc::Gen<double> Real(double low, double high) {
  constexpr std::int64_t kSteps = std::int64_t{1} << 53;
  return rc::gen::map(rc::gen::inRange<std::int64_t>(0, kSteps + 1), [=](std::int64_t step) {
    return low + (high - low) * (static_cast<double>(step) / static_cast<double>(kSteps));
  });
}

inline rc::Gen<Eigen::Vector3d> Vector(double bound) {
  return rc::gen::apply([](double x, double y, double z) { return Eigen::Vector3d(x, y, z); },
                        Real(-bound, bound), Real(-bound, bound), Real(-bound, bound));
}

inline rc::Gen<Eigen::Vector3d> UnitVector() {
  return rc::gen::apply(
      [](double z, double phi) {
        const double rho = std::sqrt(1.0 - z * z);
        return Eigen::Vector3d(rho * std::cos(phi), rho * std::sin(phi), z);
      },
      Real(-1.0, 1.0), Real(-3.141592653589793, 3.141592653589793));
}

// Angles in [0, max_angle], often 0, tiny, or within 1e-4 of the bound.
inline rc::Gen<Eigen::Vector3d> RotationVector(double max_angle) {
  const auto tiny = rc::gen::map(Real(-16.0, -3.0), [](double e) { return std::pow(10.0, e); });
  const auto near_bound =
      rc::gen::map(Real(-12.0, -4.0), [=](double e) { return max_angle - std::pow(10.0, e); });
  const auto angle = rc::gen::weightedOneOf<double>({{1, rc::gen::just(0.0)},
                                                     {1, rc::gen::just(max_angle)},
                                                     {3, tiny},
                                                     {3, near_bound},
                                                     {6, Real(0.0, max_angle)}});
  return rc::gen::apply(
      [](double a, const Eigen::Vector3d& axis) { return Eigen::Vector3d(a * axis); }, angle,
      UnitVector());
}

inline rc::Gen<Eigen::Quaterniond> AnyRotation() {
  return rc::gen::map(RotationVector(3.141592653589793), [](const Eigen::Vector3d& w) {
    const double half = 0.5 * w.norm();
    Eigen::Quaterniond q(std::cos(half), 0.0, 0.0, 0.0);
    if (half > 0.0) q.vec() = std::sin(half) / (2.0 * half) * w;
    return q.normalized();
  });
}

inline rc::Gen<Pose3> AnyPose(double bound) {
  return rc::gen::apply(
      [](const Eigen::Quaterniond& q, const Eigen::Vector3d& t) { return Pose3(q, t); },
      AnyRotation(), Vector(bound));
}

// [translation within bound; rotation up to max_angle].
inline rc::Gen<Vector6d> Twist(double bound, double max_angle) {
  return rc::gen::apply(
      [](const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
        Vector6d xi;
        xi << v, w;
        return xi;
      },
      Vector(bound), RotationVector(max_angle));
}

}  // namespace mlvi::testing

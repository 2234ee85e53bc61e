// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/vehicles.h"

#include <cmath>
#include <numbers>

namespace mlvi {
namespace {

void AddWheels(MeshBuilder& b, const Placement& place, double front, double rear, double half,
               double radius, MaterialId rubber) {
  for (const double x : {front, rear}) {
    for (const double side : {-1.0, 1.0}) {
      AddPipe(b, place.At(x, side * (half - 0.2), radius),
              place.At(x, side * (half + 0.01), radius), radius, radius, 14, rubber);
    }
  }
}

void AddMirrors(MeshBuilder& b, const Placement& place, double x, double half, double z,
                MaterialId paint) {
  for (const double side : {-1.0, 1.0})
    AddBoxAt(b, place, {x, side * (half + 0.09), z}, {0.1, 0.18, 0.13}, paint);
}

}  // namespace

void AddCar(MeshBuilder& b, const Placement& place, MaterialId paint, const Palette& m) {
  AddExtrusion(b, place,
               {{-2.15, 0.3}, {2.1, 0.25}, {2.15, 0.65}, {1.1, 0.92}, {-2.0, 0.98}, {-2.15, 0.8}},
               0.88, paint);
  // The cabin: glass sides under a painted roof.
  AddExtrusion(b, place, {{-1.85, 0.95}, {1.05, 0.9}, {0.35, 1.4}, {-1.35, 1.42}}, 0.76,
               m.dark_glass);
  AddExtrusion(b, place, {{-1.4, 1.41}, {0.4, 1.39}, {0.2, 1.46}, {-1.2, 1.47}}, 0.74, paint);
  for (const double x : {0.75, -0.35, -1.55}) {
    for (const double side : {-1.0, 1.0}) {
      const double lean = x > 0.5 ? -0.45 : (x < -1.0 ? 0.25 : 0.0);
      AddBeam(b, place.At(x, 0.77 * side, 0.93), place.At(x + lean, 0.75 * side, 1.43), 0.05, 0.05,
              paint);
    }
  }
  AddMirrors(b, place, 0.75, 0.88, 0.95, paint);
  AddWheels(b, place, 1.35, -1.3, 0.88, 0.32, m.rubber);
  for (const double side : {-1.0, 1.0}) {
    AddBoxAt(b, place, {2.11, 0.65 * side, 0.55}, {0.08, 0.3, 0.12}, m.lamp);
    AddBoxAt(b, place, {-2.13, 0.68 * side, 0.65}, {0.08, 0.25, 0.2}, m.red_car);
  }
}

void AddVan(MeshBuilder& b, const Placement& place, MaterialId paint, const Palette& m) {
  AddExtrusion(b, place,
               {{-2.8, 0.35}, {2.75, 0.3}, {2.8, 0.9}, {2.1, 1.25}, {1.35, 2.4}, {-2.8, 2.5}}, 1.0,
               paint);
  AddExtrusion(b, place, {{1.45, 1.3}, {2.08, 1.3}, {1.42, 2.3}, {1.3, 2.3}}, 1.01, m.dark_glass);
  AddMirrors(b, place, 1.9, 1.0, 1.3, m.rubber);
  AddWheels(b, place, 1.8, -1.7, 1.0, 0.36, m.rubber);
  for (const double side : {-1.0, 1.0})
    AddBoxAt(b, place, {2.76, 0.75 * side, 0.7}, {0.08, 0.3, 0.18}, m.lamp);
}

void AddBicycle(MeshBuilder& b, const Placement& place, const Palette& m) {
  constexpr int kSegments = 14;
  for (const double x : {-0.52, 0.52}) {
    for (int i = 0; i < kSegments; ++i) {
      const auto rim = [&](int k) {
        const double angle = 2.0 * std::numbers::pi * k / kSegments;
        return place.At(x + 0.34 * std::cos(angle), 0.0, 0.36 + 0.34 * std::sin(angle));
      };
      AddBeam(b, rim(i), rim(i + 1), 0.04, 0.03, m.rubber);
    }
  }
  const Eigen::Vector3d crank = place.At(-0.08, 0.0, 0.3), seat = place.At(-0.22, 0.0, 0.85),
                        head = place.At(0.38, 0.0, 0.85), front = place.At(0.52, 0.0, 0.36),
                        rear = place.At(-0.52, 0.0, 0.36);
  for (const auto& [from, to] :
       {std::pair(crank, seat), std::pair(crank, head), std::pair(seat, head),
        std::pair(head, front), std::pair(crank, rear), std::pair(seat, rear)})
    AddBeam(b, from, to, 0.035, 0.035, m.red_car);
  AddBoxAt(b, place, {-0.25, 0.0, 0.87}, {0.26, 0.14, 0.06}, m.rubber);
  AddBeam(b, place.At(0.36, -0.28, 1.0), place.At(0.36, 0.28, 1.0), 0.03, 0.03, m.metal);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/furniture.h"

#include <cmath>
#include <numbers>

namespace mlvi {

void AddTable(MeshBuilder& b, const Placement& place, const Eigen::Vector3d& size,
              const Palette& m) {
  AddBoxAt(b, place, {0.0, 0.0, size.z() - 0.04}, {size.x(), size.y(), 0.04}, m.wood);
  for (const double x : {-0.46, 0.46}) {
    for (const double y : {-0.44, 0.44})
      AddBoxAt(b, place, {x * size.x(), y * size.y(), 0.0}, {0.05, 0.05, size.z() - 0.04}, m.metal);
  }
}

void AddChair(MeshBuilder& b, const Placement& place, const Palette& m) {
  AddBoxAt(b, place, {0.0, 0.0, 0.43}, {0.44, 0.44, 0.05}, m.cloth);
  AddBoxAt(b, place, {0.0, 0.21, 0.55}, {0.42, 0.04, 0.4}, m.cloth);
  for (const double x : {-0.19, 0.19}) {
    AddBoxAt(b, place, {x, -0.19, 0.0}, {0.03, 0.03, 0.43}, m.metal);
    AddBoxAt(b, place, {x, 0.19, 0.0}, {0.03, 0.03, 0.9}, m.metal);
  }
}

void AddDesk(MeshBuilder& b, const Placement& place, const Palette& m, RandomStream& random) {
  AddTable(b, place, {1.5, 0.75, 0.73}, m);
  const double turn = random.Uniform(-0.25, 0.25);
  const Placement screen = place.Within(random.Uniform(-0.3, 0.3), 0.18, 0.73, turn);
  AddBoxAt(b, screen, {0.0, 0.0, 0.0}, {0.2, 0.16, 0.02}, m.plastic);
  AddBoxAt(b, screen, {0.0, 0.03, 0.02}, {0.05, 0.03, 0.12}, m.plastic);
  AddBoxAt(b, screen, {0.0, 0.0, 0.12}, {0.55, 0.04, 0.33}, m.dark_glass);
  for (int i = 0; i < 4; ++i) {
    const Placement paper = place.Within(random.Uniform(-0.6, 0.6), random.Uniform(-0.3, 0.2), 0.73,
                                         random.Uniform(-1.0, 1.0));
    AddBoxAt(b, paper, {0.0, 0.0, 0.0}, {0.21, 0.3, random.Uniform(0.005, 0.06)}, m.posters);
  }
  const Placement drawers = place.Within(0.5, 0.0);
  AddBoxAt(b, drawers, {0.0, 0.0, 0.05}, {0.4, 0.55, 0.55}, m.white_metal);
  AddChair(b,
           place.Within(random.Uniform(-0.3, 0.1), random.Uniform(-0.75, -0.6), 0.0,
                        std::numbers::pi + random.Uniform(-0.6, 0.6)),
           m);
}

void AddShelf(MeshBuilder& b, const Placement& place, double width, double height, const Palette& m,
              RandomStream& random) {
  constexpr double kDepth = 0.35, kBoard = 0.03;
  for (const double side : {-0.5, 0.5})
    AddBoxAt(b, place, {side * (width - kBoard), 0.0, 0.0}, {kBoard, kDepth, height}, m.wood);
  AddBoxAt(b, place, {0.0, 0.5 * kDepth - 0.01, 0.0}, {width, 0.02, height}, m.wood);
  for (double z = 0.05; z < height; z += 0.38) {
    AddBoxAt(b, place, {0.0, 0.0, z}, {width - 2.0 * kBoard, kDepth, kBoard}, m.wood);
    if (z + 0.38 > height) break;
    for (double x = 0.05 - 0.5 * width; x < 0.5 * width - 0.3;) {
      const double w = random.Uniform(0.04, 0.28);
      if (random.Uniform() < 0.75) {
        AddBoxAt(b, place, {x + 0.5 * w, random.Uniform(-0.05, 0.04), z + kBoard},
                 {w, random.Uniform(0.15, 0.24), random.Uniform(0.15, 0.33)},
                 w > 0.2 ? m.cardboard : m.books);
      }
      x += w + random.Uniform(0.003, 0.03);
    }
  }
}

void AddSofa(MeshBuilder& b, const Placement& place, double width, const Palette& m) {
  AddBoxAt(b, place, {0.0, 0.0, 0.08}, {width, 0.85, 0.34}, m.cloth);
  AddBoxAt(b, place, {0.0, 0.34, 0.42}, {width, 0.18, 0.42}, m.cloth);
  for (const double side : {-0.5, 0.5})
    AddBoxAt(b, place, {side * (width + 0.16), 0.0, 0.08}, {0.16, 0.85, 0.55}, m.cloth);
}

void AddClutter(MeshBuilder& b, const Placement& place, double radius, int count, const Palette& m,
                RandomStream& random) {
  const std::array<MaterialId, 6> materials = {m.cardboard, m.wood,  m.plastic,
                                               m.metal,     m.cloth, m.white_metal};
  for (int i = 0; i < count; ++i) {
    const double angle = random.Uniform(0.0, 2.0 * std::numbers::pi);
    const double distance = radius * std::sqrt(random.Uniform());
    const Placement thing = place.Within(distance * std::cos(angle), distance * std::sin(angle),
                                         0.0, random.Uniform(0.0, std::numbers::pi));
    const MaterialId material = materials[static_cast<std::size_t>(random.Uniform(0.0, 6.0))];
    const double kind = random.Uniform();
    if (kind < 0.6) {
      AddBoxAt(b, thing, Eigen::Vector3d::Zero(),
               {random.Uniform(0.2, 0.7), random.Uniform(0.2, 0.6), random.Uniform(0.12, 0.6)},
               material);
    } else if (kind < 0.8) {
      AddPipe(b, thing.origin, thing.At(0.0, 0.0, random.Uniform(0.3, 0.5)), 0.13, 0.16, 12,
              material);
    } else {
      AddBeam(b, thing.At(-0.6, 0.0, 0.06), thing.At(0.7, 0.1, 0.06 + random.Uniform(0.0, 0.1)),
              0.12, 0.08, m.wood);
    }
  }
}

void AddRadiator(MeshBuilder& b, const Placement& place, double width, const Palette& m) {
  for (double x = 0.05 - 0.5 * width; x < 0.5 * width; x += 0.1)
    AddBoxAt(b, place, {x, 0.0, 0.15}, {0.06, 0.12, 0.6}, m.white_metal);
  AddBoxAt(b, place, {0.0, 0.0, 0.7}, {width, 0.06, 0.05}, m.white_metal);
}

void AddPicture(MeshBuilder& b, const Placement& place, double width, double height,
                MaterialId material) {
  AddBoxAt(b, place, Eigen::Vector3d::Zero(), {width, 0.03, height}, material);
}

void AddBench(MeshBuilder& b, const Placement& place, const Palette& m) {
  AddBoxAt(b, place, {0.0, 0.0, 0.42}, {1.8, 0.45, 0.06}, m.wood);
  AddBoxAt(b, place, {0.0, 0.25, 0.5}, {1.8, 0.05, 0.4}, m.wood);
  for (const double x : {-0.7, 0.7}) AddBoxAt(b, place, {x, 0.0, -0.1}, {0.08, 0.4, 0.52}, m.metal);
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "mlvi/sim/mesh_builder.h"
#include "mlvi/sim/places.h"

namespace mlvi {
namespace {

constexpr double kHalf = 20.0;    // m, half the side of the quadrangle
constexpr double kBottom = -0.3;  // m, where facades start: below the uneven ground
constexpr double kCarried = 1.4;  // m, height of the sensor above the ground

struct Materials {
  MaterialId stone, plaster, glass, wood, grass, bark, leaf, metal;
};

Materials AddMaterials(MeshBuilder& builder) {
  return {.stone = builder.AddMaterial("stone", 0.45),
          .plaster = builder.AddMaterial("plaster", 0.7),
          .glass = builder.AddMaterial("glass", 0.06),
          .wood = builder.AddMaterial("wood", 0.35),
          .grass = builder.AddMaterial("grass", 0.5),
          .bark = builder.AddMaterial("bark", 0.3),
          .leaf = builder.AddMaterial("leaf", 0.55),
          .metal = builder.AddMaterial("metal", 0.25)};
}

// One side of the quadrangle: its look differs from the others', so that no two corners are alike.
struct FacadeStyle {
  double height, bay, window_width, window_height, pillar_depth;
};

// Windows in bays and floors, some left out; a door in one bay.
std::vector<PanelHole> Openings(const FacadeStyle& style, const Materials& m,
                                RandomStream& random) {
  std::vector<PanelHole> holes;
  const int bays = static_cast<int>(2.0 * kHalf / style.bay);
  const int door = static_cast<int>(random.Uniform(1.0, bays - 1.0));
  for (int i = 0; i < bays; ++i) {
    const double centre = (i + 0.5) * style.bay;
    for (int floor = 0; 3.6 * (floor + 1) < style.height; ++floor) {
      const double sill = 1.3 + 3.6 * floor, half = 0.5 * style.window_width;
      if (floor == 0 && i == door) {
        holes.push_back({centre - 0.9, centre + 0.9, 0.3, 2.9, 0.6, false, m.wood});
      } else if (random.Uniform() > 0.15) {
        holes.push_back(
            {centre - half, centre + half, sill, sill + style.window_height, 0.3, false, m.glass});
      }
    }
  }
  return holes;
}

// The facade on the side that `side` quarter turns lead to from +x.
void AddFacade(MeshBuilder& builder, int side, const FacadeStyle& style, const Materials& m,
               RandomStream& random) {
  const double angle = 0.5 * std::numbers::pi * side;
  const Eigen::Vector3d out(std::round(std::cos(angle)), std::round(std::sin(angle)), 0.0);
  const Eigen::Vector3d along(out.y(), -out.x(),
                              0.0);  // along x up = -out: the normal looks into the court
  const PanelFrame frame{.corner = kHalf * out - kHalf * along + kBottom * Eigen::Vector3d::UnitZ(),
                         .u = along,
                         .width = 2.0 * kHalf,
                         .height = style.height};
  builder.AddPanel(frame, side % 2 == 0 ? m.stone : m.plaster, Openings(style, m, random));
  const int bays = static_cast<int>(2.0 * kHalf / style.bay);
  for (int i = 1; i < bays; ++i) {
    if (random.Uniform() < 0.3) continue;
    const Eigen::Vector3d base =
        frame.corner + i * style.bay * along - 0.5 * style.pillar_depth * out;
    const double width = random.Uniform(0.35, 0.55);
    builder.AddBox(base, {width, style.pillar_depth, style.height}, angle + 0.5 * std::numbers::pi,
                   m.stone);
  }
}

// Hills and hollows of a few centimetres on a grid of 1 m.
void AddGround(MeshBuilder& builder, MaterialId material, RandomStream& random) {
  constexpr int kCells = 42;
  std::array<std::array<double, kCells + 1>, kCells + 1> z;
  for (auto& row : z) {
    for (double& value : row) value = random.Uniform(-0.06, 0.06);
  }
  const auto at = [&](int i, int j) -> Eigen::Vector3d {
    return {i - 0.5 * kCells, j - 0.5 * kCells,
            z[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]};
  };
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j)
      builder.AddQuad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), material);
  }
}

void AddBench(MeshBuilder& builder, const Eigen::Vector3d& base, double yaw, const Materials& m) {
  const Eigen::Vector3d across(-std::sin(yaw), std::cos(yaw), 0.0),
      along(std::cos(yaw), std::sin(yaw), 0.0);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  builder.AddBox(base + 0.42 * up, {1.8, 0.45, 0.06}, yaw, m.wood);
  builder.AddBox(base + 0.25 * across + 0.5 * up, {1.8, 0.05, 0.4}, yaw, m.wood);
  for (const double side : {-0.7, 0.7})
    builder.AddBox(base + side * along - 0.1 * up, {0.08, 0.4, 0.52}, yaw, m.metal);
}

void AddGarden(MeshBuilder& builder, const Materials& m, RandomStream& random) {
  const std::vector<Eigen::Vector2d> trees = {
      {5.5, 4.5}, {-4.5, 6.0}, {-6.0, -3.5}, {15.5, 15.0}, {-15.8, -14.8}};
  for (const Eigen::Vector2d& at : trees) {
    const Eigen::Vector3d base(at.x() + random.Uniform(-0.6, 0.6),
                               at.y() + random.Uniform(-0.6, 0.6), -0.1);
    builder.AddTree(base, random.Uniform(7.0, 9.5), random.Uniform(1.8, 2.6), 1500, m.bark, m.leaf,
                    random);
  }
  const std::vector<Eigen::Vector3d> benches = {{0.0, 17.5, 0.0},
                                                {7.0, 17.6, 0.05},
                                                {17.5, -4.0, -1.57},
                                                {-17.4, 3.0, 1.6},
                                                {2.0, -7.0, 3.2}};  // x, y, yaw
  for (const Eigen::Vector3d& b : benches) AddBench(builder, {b.x(), b.y(), 0.0}, b.z(), m);
  builder.AddColumn({4.0, -3.0, -0.1}, 1.6, 0.9, 24, m.stone);  // fountain basin and its pillar
  builder.AddColumn({4.0, -3.0, 0.8}, 0.25, 1.8, 12, m.stone);
}

}  // namespace

Place MakeCourtyard(std::uint64_t seed) {
  RandomStream random(seed, "courtyard");
  MeshBuilder builder;
  const Materials m = AddMaterials(builder);
  const std::array<FacadeStyle, 4> styles = {{{16.0, 4.0, 1.6, 2.0, 0.4},
                                              {15.0, 5.0, 2.4, 1.8, 0.6},
                                              {17.0, 3.2, 1.2, 2.1, 0.3},
                                              {15.5, 4.4, 1.9, 1.6, 0.5}}};
  for (int side = 0; side < 4; ++side)
    AddFacade(builder, side, styles[static_cast<std::size_t>(side)], m, random);
  AddGround(builder, m.grass, random);
  AddGarden(builder, m, random);
  const double r = 10.5, z = kCarried;
  WalkingPath path({{0.0, -r, z}, {r, -r, z}, {r, r - 1.0, z}, {-r + 1.0, r, z}, {-r, -r, z}}, 1.2);
  return {.world = World(std::move(builder).Finish()), .path = std::move(path)};
}

}  // namespace mlvi

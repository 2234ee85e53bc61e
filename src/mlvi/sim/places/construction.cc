// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <numbers>

#include "mlvi/sim/places.h"
#include "mlvi/sim/places/facade.h"
#include "mlvi/sim/places/furniture.h"
#include "mlvi/sim/places/people.h"
#include "mlvi/sim/places/rooms.h"

namespace mlvi {
namespace {

// An upper storey in the raw: slabs at z = 0 and kHeight on columns, open to all sides, its floor
// kLevel above the ground around the building.
constexpr double kEast = 32.0, kNorth = 20.0, kHeight = 3.1, kLevel = 9.0;  // m

void AddFrame(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  // Shafts of stairs and lift are left open in the slabs.
  const std::vector<PanelHole> shafts = {{12.0, 15.0, 8.0, 12.5, 0.25, true},
                                         {24.0, 25.5, 3.0, 4.5, 0.25, true}};
  builder.AddPanel({{0.0, 0.0, 0.0}, x, y, kEast, kNorth}, m.concrete, shafts);
  builder.AddPanel({{0.0, 0.0, kHeight}, x, y, kEast, kNorth}, m.concrete,
                   {{12.0, 15.0, 8.0, 12.5, 0.25, true}});
  for (double u = 0.5; u < kEast; u += 6.2) {
    for (const double v : {0.5, 6.8, 13.2, 19.5})
      builder.AddBox({u, v, 0.0}, {0.45, 0.45, kHeight}, 0.0, m.concrete);
    AddBeam(builder, {u, 0.0, kHeight - 0.2}, {u, kNorth, kHeight - 0.2}, 0.35, 0.4, m.concrete);
  }
  // The core around the shaft, walls of blocks half built, door openings.
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  builder.AddPanel({{11.8, 7.8, 0.0}, y, z, 4.9, kHeight}, m.concrete);
  builder.AddPanel({{15.2, 7.8, 0.0}, y, z, 4.9, kHeight}, m.concrete, {Passage(1.5, 2.7, 2.2)});
  builder.AddPanel({{11.8, 12.7, 0.0}, x, z, 3.4, kHeight}, m.concrete);
  builder.AddPanel({{20.0, 10.0, 0.0}, x, z, 11.0, kHeight}, m.brick, {Passage(3.0, 4.3, 2.2)});
  builder.AddPanel({{20.0, 10.0, 0.0}, y, z, 6.0, 1.0 + random.Uniform(0.0, 0.8)}, m.brick);
  builder.AddPanel({{26.5, 13.5, 0.0}, x, z, 5.0, 2.2}, m.brick);
  for (const double v : {0.15, kNorth - 0.15})
    AddRailing(builder, {0.3, v, 0.0}, {kEast - 0.3, v, 0.0}, 2.4, m.wood);
  for (const double u : {0.15, kEast - 0.15})
    AddRailing(builder, {u, 0.3, 0.0}, {u, kNorth - 0.3, 0.0}, 2.4, m.wood);
}

// Steel props under the fresh slab, stacks of material, starter bars, pipes, a mixer.
void AddSite(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (double u = 18.5; u < 30.0; u += 1.9) {
    for (double v = 1.9; v < 6.0; v += 2.1) {
      if (random.Uniform() < 0.35) continue;
      const double a = u + random.Uniform(-0.1, 0.1), b = v + random.Uniform(-0.1, 0.1);
      AddPipe(builder, {a, b, 0.0}, {a, b, kHeight}, 0.035, 0.03, 8, m.rust);
    }
  }
  for (const Eigen::Vector3d& s : {Eigen::Vector3d(4.0, 2.0, 0.1), Eigen::Vector3d(9.3, 17.6, 1.4),
                                   Eigen::Vector3d(28.5, 17.3, 0.3)}) {
    const Placement stack{{s.x(), s.y(), 0.0}, s.z()};
    for (int layer = 0; layer < 5; ++layer)
      AddBoxAt(builder, stack, {random.Uniform(-0.05, 0.05), 0.0, 0.12 * layer}, {2.2, 1.1, 0.1},
               layer % 2 ? m.wood : m.cardboard);
  }
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(2.5, 17.5), Eigen::Vector2d(17.8, 17.8),
                                    Eigen::Vector2d(30.3, 8.4), Eigen::Vector2d(9.6, 10.0)})
    AddClutter(builder, {{at.x(), at.y(), 0.0}}, 0.9, 12, m, random);
  for (double u = 3.0; u < 9.0; u += 0.25)
    AddPipe(builder, {u, 18.6, 0.0}, {u + random.Uniform(-0.03, 0.03), 18.6, 1.1}, 0.008, 0.008, 5,
            m.rust);
  for (const double v : {4.2, 15.4})
    AddPipe(builder, {0.5, v, 2.65}, {kEast - 0.5, v, 2.6}, 0.12, 0.12, 12, m.metal);
  AddPipe(builder, {7.0, 6.2, 0.5}, {7.5, 6.6, 1.2}, 0.42, 0.28, 14, m.rust);
  builder.AddBox({7.1, 6.3, 0.0}, {0.8, 0.6, 0.45}, 0.4, m.metal);
}

// The scaffold in the west and south, and the neighbourhood seen from above.
void AddAround(MeshBuilder& builder, const Palette& m, RandomStream& random) {
  for (double u = -1.0; u < kEast + 1.0; u += 2.5) {
    for (const double v : {-0.5, -1.4})
      AddPipe(builder, {u, v, -kLevel}, {u, v, 4.2}, 0.025, 0.025, 7, m.metal);
    if (random.Uniform() < 0.7)
      AddPipe(builder, {u, -1.4, 0.1}, {u + 2.5, -1.4, 2.0}, 0.025, 0.025, 7, m.metal);
  }
  for (const double z : {-0.1, 2.0})
    builder.AddBox({0.5 * kEast, -0.95, z}, {kEast + 2.0, 0.8, 0.05}, 0.0, m.wood);
  for (const double z : {1.0, 3.1})
    AddPipe(builder, {-1.0, -1.4, z}, {kEast + 1.0, -1.4, z}, 0.025, 0.025, 7, m.metal);
  builder.AddPanel({.corner = {-60.0, -50.0, -kLevel},
                    .v = Eigen::Vector3d::UnitY(),
                    .width = 150.0,
                    .height = 120.0},
                   m.soil);
  const FacadeStyle house{
      .wall = m.brick, .window = m.window, .door = m.door, .trim = m.concrete, .height = 16.0};
  AddFacades(builder, {-30.0, -42.0, -kLevel}, {60.0, 14.0}, false, {house}, {}, random);
  AddFacades(builder, {50.0, -10.0, -kLevel}, {14.0, 50.0}, false, {house}, {}, random);
  AddFacades(builder, {-15.0, 42.0, -kLevel}, {50.0, 12.0}, false, {house}, {}, random);
  AddPipe(builder, {-22.0, 14.0, -kLevel}, {-22.0, 14.0, 22.0}, 0.7, 0.7, 4, m.rust);  // the crane
  AddBeam(builder, {-34.0, 8.0, 22.0}, {12.0, 31.0, 22.0}, 0.9, 0.9, m.rust);
}

std::vector<MovingObject> Workers(RandomStream& random) {
  std::vector<MovingObject> workers;
  workers.push_back(MakePedestrian(
      "carpenter", ThereAndBack({27.0, 7.3, 0.0}, {30.0, 7.6, 0.0}, 0.5, 1.0, 0.0), random));
  workers.push_back(MakePedestrian(
      "foreman", ThereAndBack({5.5, 17.3, 0.0}, {13.0, 17.6, 0.0}, 0.5, 0.8, 4.0), random));
  return workers;
}

}  // namespace

Place MakeConstruction(std::uint64_t seed) {
  RandomStream random(seed, "construction");
  MeshBuilder builder;
  const Palette m = AddPalette(builder);
  AddFrame(builder, m, random);
  AddSite(builder, m, random);
  AddAround(builder, m, random);
  return {.world = World(std::move(builder).Finish(), Overcast(), Workers(random)),
          .path = WalkAt(kHandheldHeight,
                         {{3.2, 4.0, 0.0},
                          {10.0, 4.2, 0.0},
                          {16.6, 6.0, 0.0},
                          {17.6, 9.0, 0.0},
                          {22.9, 8.7, 0.0},
                          {23.65, 10.0, 0.0},
                          {23.8, 12.3, 0.0},
                          {24.4, 15.0, 0.0},
                          {21.5, 17.0, 0.0},
                          {13.0, 15.2, 0.0},
                          {4.0, 15.3, 0.0},
                          {3.6, 9.0, 0.0}},
                         0.45)};
}

}  // namespace mlvi

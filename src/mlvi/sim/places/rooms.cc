// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/rooms.h"

namespace mlvi {
namespace {

// The holes of a wall whose panel starts at `start` and runs along +axis or (`reversed`) along
// -axis.
std::vector<PanelHole> OnPanel(std::vector<PanelHole> holes, double start, bool reversed) {
  for (PanelHole& hole : holes) {
    const double u0 = hole.u0, u1 = hole.u1;
    hole.u0 = reversed ? start - u1 : u0 - start;
    hole.u1 = reversed ? start - u0 : u1 - start;
  }
  return holes;
}

}  // namespace

RoomMaterials Painted(MaterialId wall, MaterialId floor, MaterialId ceiling) {
  return {wall, wall, wall, wall, floor, ceiling};
}

void AddRoom(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
             const RoomMaterials& m, const WallHoles& holes) {
  const Eigen::Vector3d size = high - low, x = Eigen::Vector3d::UnitX(),
                        y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  builder.AddPanel({{high.x(), low.y(), low.z()}, -x, z, size.x(), size.z()}, m.south,
                   OnPanel(holes.south, high.x(), true));
  builder.AddPanel({{low.x(), high.y(), low.z()}, x, z, size.x(), size.z()}, m.north,
                   OnPanel(holes.north, low.x(), false));
  builder.AddPanel({{high.x(), high.y(), low.z()}, -y, z, size.y(), size.z()}, m.east,
                   OnPanel(holes.east, high.y(), true));
  builder.AddPanel({low, y, z, size.y(), size.z()}, m.west, OnPanel(holes.west, low.y(), false));
  builder.AddPanel({low, x, y, size.x(), size.y()}, m.floor);
  builder.AddPanel({low + size.z() * z, x, y, size.x(), size.y()}, m.ceiling);
}

PanelHole Passage(double u0, double u1, double height) {
  return {.u0 = u0, .u1 = u1, .v0 = 0.0, .v1 = height, .depth = 0.0, .open = true};
}

PanelHole FramedPassage(double u0, double u1, double height, MaterialId frame) {
  PanelHole hole = Passage(u0, u1, height);
  hole.depth = 0.2;
  hole.reveal = frame;
  return hole;
}

PanelHole Door(double u, MaterialId leaf, MaterialId frame, double depth) {
  return {
      .u0 = u, .u1 = u + 0.95, .v0 = 0.0, .v1 = 2.1, .depth = depth, .back = leaf, .reveal = frame};
}

PanelHole Window(double centre, double width, double height, MaterialId pane, double depth) {
  return {.u0 = centre - 0.5 * width,
          .u1 = centre + 0.5 * width,
          .v0 = 0.95,
          .v1 = 0.95 + height,
          .depth = depth,
          .back = pane};
}

}  // namespace mlvi

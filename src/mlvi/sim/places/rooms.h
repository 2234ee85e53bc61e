// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Rooms of rectangular plan and the openings of their walls.
#pragma once

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

// Holes of the walls of a room; u is the world's x (south, north) or y (east, west), v the height
// above its floor.
struct WallHoles {
  std::vector<PanelHole> south = {}, east = {}, north = {}, west = {};
};

struct RoomMaterials {
  MaterialId south, east, north, west, floor, ceiling;
};

// The same paint on all walls.
RoomMaterials Painted(MaterialId wall, MaterialId floor, MaterialId ceiling);

// The inside of a box, walls looking inwards. Neighbouring rooms lie a wall's thickness (0.2 m)
// apart.
void AddRoom(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
             const RoomMaterials& materials, const WallHoles& holes);

// A passage between rooms; the wall of one of them holds its reveals, 0.2 m deep.
PanelHole Passage(double u0, double u1, double height);
PanelHole FramedPassage(double u0, double u1, double height, MaterialId frame);
// A closed door of 0.95 x 2.1 m that starts at `u`, set back by `depth` m.
PanelHole Door(double u, MaterialId leaf, MaterialId frame, double depth = 0.06);
// A window of `width` x `height` m around `centre`, its sill 0.95 m above the floor.
PanelHole Window(double centre, double width, double height, MaterialId pane, double depth = 0.2);

}  // namespace mlvi

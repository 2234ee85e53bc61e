// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The materials that places share, so that brick is brick everywhere, and kinds of light.
#pragma once

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {

struct Palette {
  // walls
  MaterialId stone, old_stone, brick, plaster, paint, concrete, tiles;
  // floors and grounds
  MaterialId flagstone, floorboards, linoleum, carpet, gravel, grass, soil, asphalt, markings;
  // ceilings and roofs
  MaterialId ceiling, roof_tiles;
  // openings and frames: `glass` is clear (there is something behind it), `window` that of a room
  // which nobody built, `dark_glass` nearly invisible to a LiDAR
  MaterialId glass, window, dark_glass, door, frame;
  // things
  MaterialId wood, dark_wood, cloth, plastic, cardboard, posters, books, metal, rust, white_metal;
  // nature
  MaterialId bark, leaf, rock;
  // traffic
  MaterialId red_car, silver_car, dark_car, rubber, lamp, sign;
};

Palette AddPalette(MeshBuilder& builder);

// A sunny day; a grey one.
Lighting Daylight();
Lighting Overcast();
// Lamps (under the ceiling) that give about `lux` on the floor between them, besides the daylight
// that comes in at windows.
Lighting Indoors(double lux, const std::vector<Eigen::Vector3d>& lamps);
// Dark but for a lamp on the rig.
Lighting CarriedLamp(double candela);

}  // namespace mlvi

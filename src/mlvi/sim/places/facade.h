// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Outer walls of buildings.
#pragma once

#include "mlvi/sim/places/palette.h"

namespace mlvi {

struct FacadeStyle {
  MaterialId wall, window, door, trim;
  double height = 9.0;
  double storey = 3.6;         // m from floor to floor
  double bay = 3.5;            // m from window to window; jittered by a tenth
  double window_width = 1.3;   // m
  double window_height = 1.9;  // m
  double missing = 0.15;       // share of windows that were never built
  double buttress = 0.0;       // m, depth of pillars between bays; 0: none
  int doors = 1;
};

// A facade on the ground line from `corner` along the horizontal unit vector `along` (its normal is
// along x up), with bays of windows, doors, string courses, a cornice and drain pipes, all a little
// irregular. It starts 0.3 m below `corner`. `passages` (heights above `corner`) are kept free.
void AddFacade(MeshBuilder& builder, const Eigen::Vector3d& corner, const Eigen::Vector3d& along,
               double length, const FacadeStyle& style, const std::vector<PanelHole>& passages,
               RandomStream& random);

// The facades around a rectangle: the outside of a house, or (`inwards`) the sides of a court.
// `styles` are for south, east, north and west.
void AddFacades(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector2d& size,
                bool inwards, const std::vector<FacadeStyle>& styles,
                const std::vector<std::vector<PanelHole>>& passages, RandomStream& random);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A theatre of D-shaped plan with two galleries, which two sequences walk along.
#pragma once

#include "mlvi/sim/places/palette.h"

namespace mlvi {

// The half circle of kTheatreRadius lies around the origin in y > 0; the straight front is in the
// south at y = kTheatreFront. Galleries run along the sides and round the half circle; a walkway
// behind their benches is free.
constexpr double kTheatreRadius = 11.0, kTheatreFront = -6.0, kTheatreCeiling = 11.0;  // m
constexpr double kLowerGallery = 2.6, kUpperGallery = 6.2;  // m, heights of their floors
constexpr double kGalleryDoor = -1.05;  // m, y of the door in the straight east wall

// `door_height` is the floor of the gallery into which the open door in the east wall (1.1 x 2.2 m)
// leads.
void AddTheatre(MeshBuilder& builder, double door_height, const Palette& m, RandomStream& random);

// Points along the walkway of a gallery at distance `radius` from the theatre's axis, from the door
// to `angle` rad (0: east end of the half circle) or, `back`, from there to the door.
std::vector<Eigen::Vector3d> GalleryWalk(double radius, double height, double angle, bool back);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sim/places/palette.h"
#include "mlvi/sim/places/shapes.h"

namespace mlvi {

// All head along +x of their placement and stand on its origin.
// A car of 4.3 x 1.8 x 1.45 m.
void AddCar(MeshBuilder& builder, const Placement& place, MaterialId paint, const Palette& m);
// A delivery van of 5.6 x 2.0 x 2.5 m.
void AddVan(MeshBuilder& builder, const Placement& place, MaterialId paint, const Palette& m);
void AddBicycle(MeshBuilder& builder, const Placement& place, const Palette& m);

}  // namespace mlvi

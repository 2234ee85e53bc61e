// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// What stands in rooms. Things stand on the origin of their placement; x is their width, y their
// depth, their back is towards +y.
#pragma once

#include "mlvi/sim/places/palette.h"
#include "mlvi/sim/places/shapes.h"

namespace mlvi {

void AddTable(MeshBuilder& builder, const Placement& place, const Eigen::Vector3d& size,
              const Palette& m);
void AddChair(MeshBuilder& builder, const Placement& place, const Palette& m);
// A desk with a screen, papers and a chair drawn out a little.
void AddDesk(MeshBuilder& builder, const Placement& place, const Palette& m, RandomStream& random);
// Shelves with books and boxes of random sizes.
void AddShelf(MeshBuilder& builder, const Placement& place, double width, double height,
              const Palette& m, RandomStream& random);
void AddSofa(MeshBuilder& builder, const Placement& place, double width, const Palette& m);
// Boards, boxes, buckets and the like within `radius` m.
void AddClutter(MeshBuilder& builder, const Placement& place, double radius, int count,
                const Palette& m, RandomStream& random);
// A radiator of `width` m under a window.
void AddRadiator(MeshBuilder& builder, const Placement& place, double width, const Palette& m);
// A picture or notice board of `width` x `height` m, its lower edge at the origin, 3 cm thick.
void AddPicture(MeshBuilder& builder, const Placement& place, double width, double height,
                MaterialId material);
void AddBench(MeshBuilder& builder, const Placement& place, const Palette& m);

}  // namespace mlvi

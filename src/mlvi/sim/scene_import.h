// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "mlvi/base/error.h"
#include "mlvi/sim/world.h"

namespace mlvi {

enum class UpAxis : int { kY = 0, kZ = 1 };

struct SceneImportOptions {
  double scale = 1.0;         // m per unit of the file
  UpAxis up = UpAxis::kY;     // glTF: always y, as Assimp makes of COLLADA; OBJ: mostly y
  double reflectivity = 0.4;  // of all materials: files do not tell that of a LiDAR's wavelength
  // Of all materials, for LiDARs: plaster, unless the mesh itself is as uneven as what it shows.
  Relief relief = {.fine = 0.001, .fine_size = 0.15, .coarse = 0.0025, .coarse_size = 0.9};
};

// A mesh from a file of any format that Assimp reads (tried: glTF, OBJ, COLLADA), with the pictures
// of its materials (in the file or beside it) or, without one, their plain colours. Triangles
// without area are left out. Errors (kInput): a file that is not there or not understood, without
// triangles, with coordinates that are not finite or an extent beyond 10 km (the scale is wrong), a
// picture that cannot be read.
Expected<TriangleMesh> ImportScene(const std::string& path, const SceneImportOptions& options);

}  // namespace mlvi

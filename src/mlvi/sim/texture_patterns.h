// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlvi/sim/texture.h"

namespace mlvi {

// Draws the recipe, `size` texels a side; bricks, slabs, boards and stones have their usual size
// where one repeat covers 4 m. Same arguments, same image.
constexpr int kTextureSize = 1024;
Texture DrawTexture(const TextureRecipe& recipe, int size = kTextureSize,
                    TextureTint tint = TextureTint::kColour);

}  // namespace mlvi

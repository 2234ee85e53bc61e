// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/surface_looks.h"

#include <algorithm>
#include <iterator>
#include <string_view>

namespace mlvi {
namespace {

struct Look {
  std::string_view name;
  TexturePattern pattern;
  Eigen::Vector3f light, dark;  // linear reflectances
  double tile = 4.0;            // m
  double mirror = 0.0;
  double emission = 0.0;  // cd/m^2
};

using P = TexturePattern;
using C = Eigen::Vector3f;

// Clean textures on large bare surfaces, as rooms have them; rich ones outdoors.
const Look kLooks[] = {
    {"stone", P::kStoneBlocks, C(0.55F, 0.50F, 0.40F), C(0.16F, 0.14F, 0.11F)},
    {"old stone", P::kStoneBlocks, C(0.42F, 0.37F, 0.28F), C(0.08F, 0.07F, 0.06F), 5.0},
    {"brick", P::kBrick, C(0.50F, 0.33F, 0.26F), C(0.10F, 0.07F, 0.06F)},
    {"plaster", P::kPlaster, C(0.68F, 0.65F, 0.58F), C(0.35F, 0.32F, 0.28F)},
    {"wall paint", P::kPlaster, C(0.75F, 0.74F, 0.70F), C(0.40F, 0.38F, 0.35F), 5.0},
    {"ceiling", P::kTiles, C(0.78F, 0.78F, 0.76F), C(0.50F, 0.50F, 0.50F), 7.8},
    {"concrete", P::kConcrete, C(0.42F, 0.41F, 0.39F), C(0.15F, 0.15F, 0.14F)},
    {"tiles", P::kTiles, C(0.70F, 0.70F, 0.68F), C(0.25F, 0.25F, 0.25F), 4.0, 0.03},
    {"flagstone", P::kPaving, C(0.44F, 0.42F, 0.37F), C(0.12F, 0.11F, 0.10F)},
    {"floorboards", P::kWood, C(0.42F, 0.40F, 0.36F), C(0.10F, 0.09F, 0.08F), 4.0, 0.02},
    {"linoleum", P::kCarpet, C(0.30F, 0.31F, 0.29F), C(0.18F, 0.18F, 0.17F), 4.0, 0.02},
    {"carpet", P::kCarpet, C(0.22F, 0.24F, 0.30F), C(0.08F, 0.09F, 0.12F)},
    {"gravel", P::kGravel, C(0.52F, 0.49F, 0.43F), C(0.08F, 0.08F, 0.07F)},
    {"grass", P::kGrass, C(0.24F, 0.28F, 0.22F), C(0.03F, 0.04F, 0.03F)},
    {"soil", P::kGravel, C(0.24F, 0.18F, 0.12F), C(0.05F, 0.04F, 0.03F), 3.0},
    {"asphalt", P::kAsphalt, C(0.20F, 0.20F, 0.20F), C(0.05F, 0.05F, 0.05F)},
    {"road markings", P::kPlaster, C(0.75F, 0.75F, 0.72F), C(0.30F, 0.30F, 0.30F)},
    {"roof tiles", P::kRoofTiles, C(0.45F, 0.38F, 0.33F), C(0.08F, 0.07F, 0.06F)},
    {"glass", P::kPlain, C(0.05F, 0.06F, 0.07F), C(0.05F, 0.06F, 0.07F), 4.0, 0.08},
    {"dark glass", P::kPlain, C(0.02F, 0.02F, 0.02F), C(0.02F, 0.02F, 0.02F), 4.0, 0.06},
    {"door", P::kWood, C(0.45F, 0.38F, 0.30F), C(0.16F, 0.12F, 0.09F), 3.3},
    {"door frame", P::kPlain, C(0.12F, 0.12F, 0.12F), C(0.12F, 0.12F, 0.12F)},
    {"frame", P::kPlain, C(0.55F, 0.53F, 0.50F), C(0.55F, 0.53F, 0.50F)},
    {"wood", P::kWood, C(0.48F, 0.44F, 0.38F), C(0.14F, 0.12F, 0.10F), 3.0},
    {"dark wood", P::kWood, C(0.22F, 0.18F, 0.14F), C(0.05F, 0.04F, 0.03F), 3.0},
    {"furniture", P::kWood, C(0.50F, 0.46F, 0.40F), C(0.18F, 0.15F, 0.12F), 2.6},
    {"cloth", P::kFabric, C(0.42F, 0.40F, 0.45F), C(0.08F, 0.09F, 0.16F), 1.2},
    {"plastic", P::kPlain, C(0.30F, 0.32F, 0.36F), C(0.30F, 0.32F, 0.36F), 4.0, 0.03},
    {"cardboard", P::kPosters, C(0.46F, 0.37F, 0.26F), C(0.12F, 0.10F, 0.08F), 2.1},
    {"posters", P::kPosters, C(0.75F, 0.74F, 0.70F), C(0.08F, 0.08F, 0.08F), 3.4},
    {"books", P::kShelves, C(0.60F, 0.56F, 0.50F), C(0.05F, 0.05F, 0.05F), 3.7},
    {"metal", P::kMetal, C(0.32F, 0.33F, 0.34F), C(0.12F, 0.11F, 0.10F), 4.0, 0.05},
    {"rusty steel", P::kMetal, C(0.30F, 0.20F, 0.14F), C(0.10F, 0.06F, 0.04F), 2.0},
    {"white metal", P::kMetal, C(0.72F, 0.72F, 0.72F), C(0.35F, 0.32F, 0.30F), 4.0, 0.04},
    {"bark", P::kBark, C(0.30F, 0.25F, 0.20F), C(0.05F, 0.04F, 0.03F), 2.0},
    {"leaf", P::kFoliage, C(0.22F, 0.28F, 0.20F), C(0.03F, 0.05F, 0.03F), 2.0},
    {"rock", P::kRock, C(0.34F, 0.31F, 0.28F), C(0.05F, 0.05F, 0.04F)},
    {"red car paint", P::kPlain, C(0.40F, 0.03F, 0.03F), C(0.40F, 0.03F, 0.03F), 4.0, 0.06},
    {"silver car paint", P::kPlain, C(0.50F, 0.51F, 0.52F), C(0.50F, 0.51F, 0.52F), 4.0, 0.08},
    {"dark car paint", P::kPlain, C(0.03F, 0.04F, 0.06F), C(0.03F, 0.04F, 0.06F), 4.0, 0.06},
    {"rubber", P::kPlain, C(0.03F, 0.03F, 0.03F), C(0.03F, 0.03F, 0.03F)},
    {"skin", P::kPlain, C(0.48F, 0.30F, 0.22F), C(0.48F, 0.30F, 0.22F)},
    {"hair", P::kBark, C(0.10F, 0.07F, 0.05F), C(0.02F, 0.02F, 0.01F), 0.5},
    {"lamp", P::kPlain, C(0.80F, 0.80F, 0.78F), C(0.80F, 0.80F, 0.78F), 4.0, 0.0, 1500.0},
};

}  // namespace

Material UsualMaterial(const std::string& name, double reflectivity) {
  Material material{.name = name, .reflectivity = reflectivity};
  const auto* look = std::find_if(std::begin(kLooks), std::end(kLooks),
                                  [&](const Look& l) { return l.name == name; });
  if (look == std::end(kLooks)) return material;
  material.texture = {.pattern = look->pattern,
                      .seed = static_cast<std::uint64_t>(look - std::begin(kLooks)) + 1,
                      .light = look->light,
                      .dark = look->dark};
  material.tile = look->tile;
  material.mirror = look->mirror;
  material.emission = look->emission;
  return material;
}

}  // namespace mlvi

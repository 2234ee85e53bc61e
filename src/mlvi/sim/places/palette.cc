// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/palette.h"

#include <array>
#include <string_view>

namespace mlvi {
namespace {

// How rough things are. Built surfaces: a third of the gaps under a straightedge that DIN 18202
// (table 3) allows over 0.1 m and over 1 m (from memory: finished walls 3 and 5 mm, floors 2 and 4,
// raw ones 5 and 10), joints and rounded edges of masonry added. Grounds: 3 to 5 mm within 1 m is
// what a real recording shows of paving and asphalt (walk_os0); gravel, soil, grass, rock by their
// grain. All assumed but that.
struct NamedRelief {
  std::string_view name;
  Relief relief;  // fine, size, coarse, size; m
};
constexpr std::array<NamedRelief, 24> kReliefs = {{
    {"stone", {0.003, 0.12, 0.004, 0.8}},        {"old stone", {0.006, 0.12, 0.010, 0.7}},
    {"brick", {0.0025, 0.1, 0.003, 0.9}},        {"plaster", {0.001, 0.15, 0.0025, 0.9}},
    {"wall paint", {0.0007, 0.15, 0.0017, 0.9}}, {"concrete", {0.0017, 0.15, 0.0033, 0.9}},
    {"ceiling", {0.0007, 0.15, 0.0017, 0.9}},    {"tiles", {0.0007, 0.15, 0.0013, 0.9}},
    {"flagstone", {0.003, 0.15, 0.004, 0.7}},    {"floorboards", {0.0010, 0.1, 0.002, 0.8}},
    {"linoleum", {0.0005, 0.15, 0.0013, 0.9}},   {"carpet", {0.0010, 0.1, 0.0013, 0.9}},
    {"roof tiles", {0.012, 0.2, 0.01, 1.0}},     {"gravel", {0.006, 0.08, 0.010, 0.6}},
    {"grass", {0.012, 0.1, 0.020, 0.5}},         {"soil", {0.008, 0.1, 0.015, 0.5}},
    {"asphalt", {0.002, 0.1, 0.004, 0.7}},       {"bark", {0.006, 0.1, 0.006, 0.3}},
    {"leaf", {0.010, 0.1, 0.010, 0.3}},          {"rock", {0.012, 0.12, 0.020, 0.4}},
    {"wood", {0.001, 0.15, 0.002, 0.8}},         {"dark wood", {0.002, 0.15, 0.003, 0.8}},
    {"books", {0.006, 0.1, 0.006, 0.3}},         {"rusty steel", {0.002, 0.1, 0.002, 0.5}},
}};

// Of things that are not in the list: plane.
Relief ReliefOf(std::string_view material) {
  for (const NamedRelief& named : kReliefs) {
    if (named.name == material) return named.relief;
  }
  return {};
}

using Colour = Eigen::Vector3f;
using Pattern = TexturePattern;

// Adds the materials one by one; each has a texture seed of its own.
class Painter {
 public:
  explicit Painter(MeshBuilder& builder) : builder_(builder) {}

  MaterialId operator()(const char* name, double reflectivity, Pattern pattern, const Colour& light,
                        const Colour& dark, double tile = 4.0) {
    return builder_.AddMaterial(Describe(name, reflectivity, pattern, light, dark, tile));
  }
  // Passes `transmission` of the light and mirrors `mirror` of it.
  MaterialId Glass(const char* name, double reflectivity, double transmission, double mirror) {
    Material glass = Describe(name, reflectivity, Pattern::kPlain, {0.1F, 0.12F, 0.13F},
                              {0.05F, 0.06F, 0.07F}, 4.0);
    glass.transmission = transmission;
    glass.mirror = glass.lidar_mirror = mirror;
    return builder_.AddMaterial(glass);
  }
  MaterialId Lamp(const char* name, double luminance) {
    Material lamp =
        Describe(name, 0.6, Pattern::kPlain, {0.8F, 0.8F, 0.75F}, {0.7F, 0.7F, 0.65F}, 4.0);
    lamp.emission = luminance;
    return builder_.AddMaterial(lamp);
  }
  MaterialId Sign(const char* name) {
    Material sign =
        Describe(name, 0.8, Pattern::kPosters, {0.7F, 0.7F, 0.68F}, {0.35F, 0.05F, 0.04F}, 1.5);
    sign.retroreflective = true;
    return builder_.AddMaterial(sign);
  }

 private:
  Material Describe(const char* name, double reflectivity, Pattern pattern, const Colour& light,
                    const Colour& dark, double tile) {
    return {.name = name,
            .reflectivity = reflectivity,
            .texture = {.pattern = pattern, .seed = ++seed_ * 7919U, .light = light, .dark = dark},
            .tile = tile,
            .relief = ReliefOf(name)};
  }

  MeshBuilder& builder_;
  std::uint64_t seed_ = 0;
};

void AddBuildings(Painter& p, Palette& m) {
  m.stone = p("stone", 0.5, Pattern::kStoneBlocks, {0.52F, 0.46F, 0.36F}, {0.25F, 0.21F, 0.15F});
  m.old_stone =
      p("old stone", 0.38, Pattern::kStoneBlocks, {0.4F, 0.35F, 0.27F}, {0.12F, 0.1F, 0.08F});
  m.brick = p("brick", 0.42, Pattern::kBrick, {0.36F, 0.16F, 0.11F}, {0.45F, 0.42F, 0.38F});
  m.plaster = p("plaster", 0.7, Pattern::kPlaster, {0.6F, 0.56F, 0.48F}, {0.42F, 0.39F, 0.33F});
  m.paint = p("wall paint", 0.65, Pattern::kPlaster, {0.62F, 0.62F, 0.6F}, {0.54F, 0.54F, 0.52F});
  m.concrete = p("concrete", 0.4, Pattern::kConcrete, {0.36F, 0.35F, 0.33F}, {0.18F, 0.17F, 0.16F});
  m.tiles = p("tiles", 0.5, Pattern::kTiles, {0.55F, 0.53F, 0.5F}, {0.3F, 0.29F, 0.27F});
  m.flagstone = p("flagstone", 0.4, Pattern::kPaving, {0.38F, 0.35F, 0.3F}, {0.14F, 0.13F, 0.11F});
  m.floorboards =
      p("floorboards", 0.35, Pattern::kWood, {0.33F, 0.21F, 0.12F}, {0.12F, 0.07F, 0.04F});
  m.linoleum = p("linoleum", 0.3, Pattern::kPlaster, {0.3F, 0.31F, 0.3F}, {0.22F, 0.22F, 0.21F});
  m.carpet = p("carpet", 0.2, Pattern::kCarpet, {0.12F, 0.13F, 0.2F}, {0.05F, 0.05F, 0.09F});
  m.ceiling = p("ceiling", 0.75, Pattern::kPlaster, {0.7F, 0.7F, 0.68F}, {0.63F, 0.63F, 0.6F});
  m.roof_tiles =
      p("roof tiles", 0.35, Pattern::kRoofTiles, {0.33F, 0.15F, 0.1F}, {0.12F, 0.06F, 0.04F});
  // Dust scatters a little: a pane is seen where nothing brighter stands behind it. Else pulses go
  // through, or away.
  m.glass = p.Glass("glass", 0.01, 0.75, 0.08);
  m.dark_glass = p.Glass("dark glass", 0.002, 0.0, 0.1);
  m.window = p.Glass("window", 0.12, 0.0, 0.25);
  m.door = p("door", 0.4, Pattern::kWood, {0.3F, 0.24F, 0.18F}, {0.17F, 0.13F, 0.1F});
  m.frame = p("frame", 0.3, Pattern::kPlain, {0.25F, 0.24F, 0.23F}, {0.2F, 0.2F, 0.2F});
}

void AddGrounds(Painter& p, Palette& m) {
  m.gravel = p("gravel", 0.35, Pattern::kGravel, {0.42F, 0.38F, 0.31F}, {0.16F, 0.14F, 0.11F});
  m.grass = p("grass", 0.5, Pattern::kGrass, {0.14F, 0.24F, 0.06F}, {0.04F, 0.09F, 0.02F});
  m.soil = p("soil", 0.25, Pattern::kRock, {0.24F, 0.17F, 0.1F}, {0.09F, 0.06F, 0.04F});
  m.asphalt = p("asphalt", 0.17, Pattern::kAsphalt, {0.12F, 0.12F, 0.12F}, {0.05F, 0.05F, 0.05F});
  m.markings = p.Sign("road markings");
  m.bark = p("bark", 0.3, Pattern::kBark, {0.22F, 0.16F, 0.1F}, {0.06F, 0.04F, 0.03F}, 2.0);
  m.leaf = p("leaf", 0.55, Pattern::kFoliage, {0.13F, 0.25F, 0.06F}, {0.03F, 0.08F, 0.02F}, 2.0);
  m.rock = p("rock", 0.3, Pattern::kRock, {0.3F, 0.26F, 0.2F}, {0.07F, 0.06F, 0.05F});
}

void AddThings(Painter& p, Palette& m) {
  m.wood = p("wood", 0.45, Pattern::kWood, {0.42F, 0.29F, 0.17F}, {0.2F, 0.12F, 0.06F}, 2.0);
  m.dark_wood = p("dark wood", 0.2, Pattern::kWood, {0.15F, 0.09F, 0.05F}, {0.05F, 0.03F, 0.02F});
  m.cloth = p("cloth", 0.5, Pattern::kFabric, {0.12F, 0.18F, 0.3F}, {0.05F, 0.07F, 0.12F}, 1.0);
  m.plastic = p("plastic", 0.4, Pattern::kPlain, {0.14F, 0.14F, 0.15F}, {0.1F, 0.1F, 0.1F});
  m.cardboard =
      p("cardboard", 0.5, Pattern::kCarpet, {0.42F, 0.31F, 0.19F}, {0.3F, 0.21F, 0.12F}, 1.5);
  m.posters = p("posters", 0.6, Pattern::kPosters, {0.7F, 0.68F, 0.62F}, {0.1F, 0.1F, 0.15F}, 2.0);
  m.books = p("books", 0.4, Pattern::kShelves, {0.5F, 0.42F, 0.3F}, {0.1F, 0.06F, 0.05F}, 2.0);
  m.metal = p("metal", 0.3, Pattern::kMetal, {0.32F, 0.33F, 0.34F}, {0.16F, 0.16F, 0.17F}, 2.0);
  m.rust = p("rusty steel", 0.25, Pattern::kRock, {0.3F, 0.14F, 0.07F}, {0.12F, 0.06F, 0.03F}, 2.0);
  m.white_metal =
      p("white metal", 0.6, Pattern::kMetal, {0.66F, 0.66F, 0.64F}, {0.5F, 0.5F, 0.48F}, 2.0);
  m.red_car = p("red paint", 0.3, Pattern::kPlain, {0.42F, 0.04F, 0.03F}, {0.3F, 0.03F, 0.02F});
  m.silver_car = p("silver paint", 0.4, Pattern::kMetal, {0.5F, 0.51F, 0.52F}, {0.4F, 0.4F, 0.4F});
  m.dark_car = p("dark paint", 0.05, Pattern::kPlain, {0.03F, 0.03F, 0.04F}, {0.02F, 0.02F, 0.02F});
  m.rubber = p("rubber", 0.06, Pattern::kPlain, {0.04F, 0.04F, 0.04F}, {0.02F, 0.02F, 0.02F});
  m.lamp = p.Lamp("lamp", 2000.0);
  m.sign = p.Sign("sign");
}

}  // namespace

// Reflectivities at 850-905 nm: vegetation and most cloth are bright there, car paint ranges from
// bright to nearly black.
Palette AddPalette(MeshBuilder& builder) {
  Palette palette{};
  Painter painter(builder);
  AddBuildings(painter, palette);
  AddGrounds(painter, palette);
  AddThings(painter, palette);
  return palette;
}

Lighting Daylight() { return {}; }

Lighting Overcast() {
  return {.sun_illuminance = 4000.0, .sky_illuminance = 9000.0, .ambient_illuminance = 20.0};
}

Lighting Indoors(double lux, const std::vector<Eigen::Vector3d>& lamps) {
  Lighting lighting{.ambient_illuminance = 0.05 * lux};
  // Together about two thirds of the light on the floor, 2.5 m below.
  for (const Eigen::Vector3d& lamp : lamps)
    lighting.lamps.push_back({.position = lamp, .intensity = 4.0 * lux});
  return lighting;
}

Lighting CarriedLamp(double candela) {
  return {.sun_illuminance = 0.0,
          .sky_illuminance = 0.0,
          .ambient_illuminance = 0.02,
          .carried_lamp_intensity = candela};
}

}  // namespace mlvi

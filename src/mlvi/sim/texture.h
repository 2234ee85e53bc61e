// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// Albedo textures: mip-mapped square images that repeat without a seam, drawn from a recipe and a
// seed. A recipe costs nothing; the image is drawn by who renders it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

namespace mlvi {

// What a surface looks like. To add one: a value here, its name, and its drawing function in the
// table of texture_patterns.cc.
enum class TexturePattern : int {
  kPlain = 0,    // one colour
  kPlaster,      // painted wall: faint stains, few features
  kConcrete,     // stains, pores, formwork joints
  kBrick,        // rows of bricks with mortar
  kStoneBlocks,  // ashlar of irregular stones
  kPaving,       // slabs with dark joints
  kTiles,        // regular tiles, almost alike
  kAsphalt,      // fine grain, patches, cracks
  kRock,         // rough natural rock, high contrast at all scales
  kGrass,        // lawn
  kFoliage,      // leaves
  kBark,         // vertical furrows
  kWood,         // boards with grain
  kCarpet,       // fine weave
  kMetal,        // smooth with scratches
  kRoofTiles,    // overlapping rows
  kGravel,       // stones of 2-6 cm
  kPosters,      // a wall of notices, posters and lettering: many corners
  kShelves,      // rows of book backs and boxes
  kFabric,       // clothes: folds and checks
};

std::string_view NameOf(TexturePattern pattern);

// Colours are linear reflectances in [0, 1] (red, green, blue). `light` is that of most of the
// surface, `dark` that of joints, stains, furrows.
struct TextureRecipe {
  TexturePattern pattern = TexturePattern::kPlain;
  std::uint64_t seed = 1;
  Eigen::Vector3f light = Eigen::Vector3f::Constant(0.45F);
  Eigen::Vector3f dark = Eigen::Vector3f::Constant(0.15F);
};

// What is kept of the colours: grey takes a quarter of the memory and half of the time, and is all
// that grey cameras see.
enum class TextureTint { kColour, kGrey };
// Of red, green, blue, in grey images.
inline const Eigen::Vector3f kLuminanceWeights(0.3F, 0.5F, 0.2F);

// A square image with its mip pyramid: level 0 has `size` (a power of two) texels a side, every
// next one half of that, each texel the mean of four. Repeats in both directions.
class Texture {
 public:
  // `texels`: row-major, `size` * `size` linear reflectances in [0, 1].
  Texture(int size, const std::vector<Eigen::Vector3f>& texels,
          TextureTint tint = TextureTint::kColour);

  int size() const { return size_; }
  // Of all texels and colours, grey or not.
  float mean() const { return mean_; }
  int levels() const { return static_cast<int>(offsets_.size()); }

  // Trilinear: bilinear within the two levels next to `lod` (0: full size; clamped to the pyramid).
  // u to the right, v down the rows, in repeats (|u|, |v| < 1e9); texel (0, 0) is centred on (0.5,
  // 0.5) / size. A grey texture gives its luminance in all three colours.
  Eigen::Vector3f Sample(float u, float v, float lod) const {
    return Mean({u, v}, Eigen::Vector2f::Zero(), 1, lod);
  }
  // The mean of `taps` (>= 1) such samples, evenly spread over the line of the length and direction
  // of `stretch` that has its middle at `uv`.
  Eigen::Vector3f Mean(const Eigen::Vector2f& uv, const Eigen::Vector2f& stretch, int taps,
                       float lod) const;

 private:
  template <typename Channels>
  void Encode(std::vector<Channels> level);

  int size_;
  TextureTint tint_;
  float mean_ = 0.0F;
  std::vector<std::size_t> offsets_;  // of each level
  // 65535 = 1. Colour: four per texel (the last one unused). Grey: one, and behind each row its
  // first texel again, so that two neighbours are one load.
  std::vector<std::uint16_t> values_;
};

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/texture_patterns.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mlvi/base/parallel.h"
#include "mlvi/sim/tile_noise.h"

namespace mlvi {
namespace {

using internal::TileNoise;

// What a pattern says about a texel: `light` mixes the recipe's colours (0: dark, 1: light), `gain`
// scales the result, `tint` (red, green, blue) colours things that have a colour of their own.
struct Shade {
  float light = 1.0F;
  float gain = 1.0F;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();
};

float Step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

// A cell of a grid whose rows are shifted against each other: where in it the texel lies.
struct Brick {
  int column, row;
  float x, y;  // in [0, 1) within the brick
};
Brick BrickAt(float u, float v, int columns, int rows, float shift) {
  const float y = v * static_cast<float>(rows);
  const int row = static_cast<int>(y);
  const float x = u * static_cast<float>(columns) + (row % 2 == 1 ? shift : 0.0F);
  const int column = static_cast<int>(x);
  return {column, row, x - static_cast<float>(column), y - static_cast<float>(row)};
}
// 1 inside of the brick, 0 in the joint of half width (wx, wy) parts of it.
float Inside(const Brick& b, float wx, float wy) {
  const float x = std::min(b.x, 1.0F - b.x), y = std::min(b.y, 1.0F - b.y);
  return Step(wx, 2.0F * wx, x) * Step(wy, 2.0F * wy, y);
}

Eigen::Vector3f Hue(float h) {  // a bright colour by a number in [0, 1)
  const auto channel = [h](float phase) {
    return 0.55F + 0.45F * std::cos(6.2831853F * (h + phase));
  };
  return {channel(0.0F), channel(0.33F), channel(0.67F)};
}

Shade Plain(float, float, const TileNoise&) { return {}; }

Shade Plaster(float u, float v, const TileNoise& n) {
  const float stain = Step(0.62F, 0.8F, n.Fractal(u, v, 3, 2, 5, 1));
  const auto mark = n.Points(u, v, 9, 9, 20);
  const float scratch = mark.id > 0.8F ? Step(0.10F, 0.05F, mark.first) : 0.0F;
  return {.light = 1.0F - 0.25F * stain - 0.5F * scratch,
          .gain = 0.95F + 0.1F * n.Fractal(u, v, 48, 48, 3, 40)};
}

Shade Concrete(float u, float v, const TileNoise& n) {
  const auto pore = n.Points(u, v, 60, 60, 10);
  const float hole = pore.id > 0.6F ? Step(0.22F, 0.12F, pore.first) : 0.0F;
  const Brick form = BrickAt(u, v, 4, 2, 0.0F);
  const float joint = 1.0F - Inside(form, 0.006F, 0.003F);
  const float tie = Step(0.035F, 0.025F, std::hypot(form.x - 0.5F, 2.0F * (form.y - 0.25F)));
  const float panel = n.Cell(form.column, form.row, 4, 2, 5);
  return {.light = 0.95F - 0.8F * hole - 0.6F * joint - 0.9F * tie -
                   0.5F * Step(0.4F, 0.75F, n.Fractal(u, v, 5, 4, 6, 30)),
          .gain = 0.9F + 0.2F * panel};
}

Shade Bricks(float u, float v, const TileNoise& n) {
  const Brick b = BrickAt(u, v, 16, 48, 0.5F);
  const float id = n.Cell(b.column, b.row, 16, 48, 1), face = Inside(b, 0.025F, 0.07F);
  const float grain = n.Fractal(u, v, 64, 64, 4, 7);
  const float brick = (0.55F + 0.6F * id) * (0.75F + 0.5F * grain);
  // Mortar is lighter and greyer than most bricks.
  return {
      .light = face * 0.8F * brick + (1.0F - face) * (0.9F + 0.3F * grain),
      .tint = face * Eigen::Vector3f(1.0F, 0.78F, 0.68F) + (1.0F - face) * Eigen::Vector3f::Ones()};
}

Shade StoneBlocks(float u, float v, const TileNoise& n) {
  const int row = static_cast<int>(v * 12.0F);
  const float wobble = 0.35F * (n.Value(u, v, 12, 12, 90) - 0.5F) / 12.0F;
  // Two stones per pair of cells, parted at a random place: irregular lengths.
  const Brick pair = BrickAt(u, v + 0.02F * wobble, 5, 12, n.Cell(0, row, 1, 12, 3));
  const float cut = 0.3F + 0.4F * n.Cell(pair.column % 5, pair.row, 5, 12, 4);
  const bool left = pair.x < cut;
  const float x = left ? pair.x / cut : (pair.x - cut) / (1.0F - cut);
  const Brick stone{2 * (pair.column % 5) + (left ? 0 : 1), pair.row, x, pair.y};
  const float face = Inside(stone, 0.018F, 0.035F);
  const float id = n.Cell(stone.column, stone.row, 10, 12, 8);
  const float rough = n.Fractal(u, v, 16, 16, 6, 50);
  const auto pit = n.Points(u, v, 70, 70, 60);
  const float hole = pit.id > 0.7F ? Step(0.3F, 0.15F, pit.first) : 0.0F;
  return {.light = face * (0.55F + 0.5F * id - 0.5F * hole) + (1.0F - face) * 0.1F,
          .gain = 0.6F + 0.8F * rough,
          .tint = {1.0F, 0.97F - 0.05F * id, 0.88F - 0.12F * id}};
}

Shade Paving(float u, float v, const TileNoise& n) {
  const Brick slab = BrickAt(u, v, 6, 8, 0.5F);
  const float id = n.Cell(slab.column, slab.row, 6, 8, 1);
  const float face = Inside(slab, 0.012F, 0.016F);
  const auto spot = n.Points(u, v, 40, 40, 20);
  const float gum = spot.id > 0.93F ? Step(0.4F, 0.3F, spot.first) : 0.0F;
  return {.light = face * (0.65F + 0.35F * id - 0.45F * gum),
          .gain = 0.7F + 0.6F * n.Fractal(u, v, 32, 32, 6, 30)};
}

Shade Tiles(float u, float v, const TileNoise& n) {
  const Brick tile = BrickAt(u, v, 13, 13, 0.0F);
  const float face = Inside(tile, 0.012F, 0.012F);
  return {.light = face,
          .gain = 0.94F + 0.08F * n.Cell(tile.column, tile.row, 13, 13, 1) +
                  0.05F * n.Fractal(u, v, 20, 20, 4, 9)};
}

Shade Asphalt(float u, float v, const TileNoise& n) {
  const auto stone = n.Points(u, v, 180, 180, 1);
  const float grain = stone.id * Step(0.55F, 0.25F, stone.first);
  const float crack = Step(0.03F, 0.008F, std::abs(n.Fractal(u, v, 4, 4, 5, 40) - 0.5F));
  const float patch = Step(0.6F, 0.62F, n.Fractal(u, v, 3, 3, 2, 70));
  return {.light = 0.25F + 0.75F * grain - 0.6F * crack,
          .gain = (0.75F + 0.5F * n.Fractal(u, v, 6, 6, 5, 20)) * (1.0F - 0.35F * patch)};
}

Shade Rock(float u, float v, const TileNoise& n) {
  const float ridge = 1.0F - 2.0F * std::abs(n.Fractal(u, v, 5, 5, 6, 1) - 0.5F);
  const auto facet = n.Points(u + 0.03F * n.Value(u, v, 8, 8, 60), v, 14, 11, 20);
  const float crack = Step(0.10F, 0.02F, facet.second - facet.first);
  return {.light = 0.2F + 0.5F * facet.id + 0.8F * (ridge - 0.6F) - 0.6F * crack,
          .gain = 0.5F + n.Fractal(u, v, 24, 24, 5, 40)};
}

Shade Grass(float u, float v, const TileNoise& n) {
  // Blades: short streaks in three directions.
  const float a = n.Value(u, v, 256, 64, 1), b = n.Value(u, v, 64, 256, 2),
              c = n.Fractal(u, v, 160, 160, 2, 3);
  const float blades = std::max(std::max(a * b * 1.6F, c * 0.9F), a * c);
  const float clump = n.Fractal(u, v, 12, 12, 4, 10), bare = n.Fractal(u, v, 4, 4, 4, 30);
  return {.light = 0.1F + 0.9F * blades,
          .gain = 0.5F + clump,
          .tint = {0.75F + 0.4F * Step(0.5F, 0.7F, bare), 1.0F, 0.45F}};
}

Shade Foliage(float u, float v, const TileNoise& n) {
  const auto leaf = n.Points(u, v, 56, 56, 1);
  const float body = Step(0.62F, 0.45F, leaf.first);
  return {.light = body * (0.35F + 0.65F * leaf.id),
          .gain = 0.55F + 0.9F * n.Fractal(u, v, 8, 8, 4, 9),
          .tint = {0.6F + 0.3F * leaf.id, 1.0F, 0.35F}};
}

Shade Bark(float u, float v, const TileNoise& n) {
  const float furrow = std::abs(n.Fractal(u, v, 40, 6, 5, 1) - 0.5F) * 4.0F;
  return {.light = std::min(1.0F, furrow) * (0.6F + 0.5F * n.Fractal(u, v, 60, 30, 4, 20)),
          .tint = {1.0F, 0.88F, 0.72F}};
}

Shade Wood(float u, float v, const TileNoise& n) {
  const Brick board = BrickAt(v, u, 2, 28, 0.37F);  // boards stand upright
  const float id = n.Cell(board.column, board.row, 3, 28, 1);
  const float rings = n.Fractal(u + id, v, 28 * 4, 3, 4, 5);
  const float grain = 0.5F + 0.5F * std::sin(60.0F * rings);
  const auto knot = n.Points(u, v, 28, 8, 30);
  const float dark = knot.id > 0.9F ? Step(0.3F, 0.1F, knot.first) : 0.0F;
  return {
      .light = Inside(board, 0.004F, 0.03F) * (0.45F + 0.35F * id + 0.25F * grain - 0.5F * dark),
      .tint = {1.0F, 0.8F, 0.58F}};
}

Shade Carpet(float u, float v, const TileNoise& n) {
  const float weave = n.Value(u, v, 256, 256, 1);
  const Brick tile = BrickAt(u, v, 8, 8, 0.0F);
  return {.light = 0.5F + 0.5F * weave,
          .gain = 0.85F + 0.15F * n.Cell(tile.column, tile.row, 8, 8, 3) +
                  0.2F * n.Fractal(u, v, 9, 9, 4, 10)};
}

Shade Metal(float u, float v, const TileNoise& n) {
  const float scratch = Step(0.90F, 0.97F, n.Value(u, v, 12, 256, 1));
  const float rust = Step(0.68F, 0.75F, n.Fractal(u, v, 7, 7, 5, 9));
  return {.light = 0.8F + 0.2F * scratch - 0.7F * rust,
          .gain = 0.92F + 0.15F * n.Fractal(u, v, 3, 40, 3, 30)};
}

Shade RoofTiles(float u, float v, const TileNoise& n) {
  const Brick tile = BrickAt(u, v, 20, 14, 0.5F);
  const float id = n.Cell(tile.column, tile.row, 20, 14, 1);
  const float arch = 1.0F - 0.4F * std::pow(2.0F * std::abs(tile.x - 0.5F), 2.0F);
  return {.light = arch * Step(0.98F, 0.88F, tile.y) * (0.5F + 0.5F * id),
          .gain = 0.75F + 0.5F * n.Fractal(u, v, 30, 30, 4, 8),
          .tint = {1.0F, 0.62F, 0.48F}};
}

Shade Gravel(float u, float v, const TileNoise& n) {
  const auto stone = n.Points(u, v, 90, 90, 1);
  const float body = Step(0.02F, 0.2F, stone.second - stone.first);
  return {.light = body * (0.25F + 0.75F * stone.id) * (1.0F + 0.5F * stone.dx - 0.5F * stone.dy),
          .gain = 0.8F + 0.4F * n.Fractal(u, v, 6, 6, 4, 9)};
}

// Lines of lettering, pictures and frames on paper, by a share of the sheets.
Shade Sheet(const Brick& b, float id, float kind, const TileNoise& n, std::uint32_t salt) {
  const float x = (b.x - 0.08F) / 0.84F, y = (b.y - 0.08F) / 0.84F;
  if (x < 0.0F || x > 1.0F || y < 0.0F || y > 1.0F || id < 0.15F) return {.light = 0.75F};
  const bool picture = kind > 0.5F ? y > 0.25F && y < 0.7F : false;
  Shade shade{.light = 1.0F, .gain = 1.1F, .tint = 0.5F * Hue(id * 7.3F) + 0.5F * Hue(kind)};
  if (kind < 0.5F) shade.tint.setOnes();
  const int line = static_cast<int>(y * 14.0F), letter = static_cast<int>(x * 24.0F);
  const float ink = n.Cell(letter + 31 * b.column, line + 17 * b.row, 997, 997, salt);
  if (picture) {
    shade.light = 0.2F + 0.8F * Step(0.4F, 0.6F, n.Fractal(x, y, 4, 4, 4, salt + 9 + b.column));
  } else if (x > 0.08F && x < 0.92F && line % 2 == 1 && ink > 0.35F) {
    shade.light = y < 0.2F ? 0.0F : 0.25F;
  }
  return shade;
}

Shade Posters(float u, float v, const TileNoise& n) {
  const Brick large = BrickAt(u, v, 5, 4, 0.5F);
  const int columns = 5, rows = 4;
  const float id = n.Cell(large.column, large.row, columns, rows, 1);
  const float kind = n.Cell(large.column, large.row, columns, rows, 2);
  if (id < 0.45F) {  // four small notices instead of a poster
    Brick small = BrickAt(large.x, large.y, 2, 2, 0.0F);
    small.column += 2 * large.column;
    small.row += 2 * large.row;
    return Sheet(small, n.Cell(small.column, small.row, 10, 8, 3),
                 n.Cell(small.column, small.row, 10, 8, 4), n, 40);
  }
  return Sheet(large, id, kind, n, 70);
}

Shade Shelves(float u, float v, const TileNoise& n) {
  const Brick shelf = BrickAt(u, v, 4, 10, 0.0F);
  if (shelf.y > 0.9F || shelf.x < 0.03F) return {.light = 0.6F, .tint = {1.0F, 0.85F, 0.65F}};
  const Brick book = BrickAt(u, v, 120, 10, 0.0F);
  const float id = n.Cell(book.column, book.row, 120, 10, 1);
  const float height = 0.15F + 0.35F * n.Cell(book.column, book.row, 120, 10, 2);
  if (shelf.y < height) return {.light = 0.0F, .gain = 0.6F};
  const float title = n.Cell(book.column, static_cast<int>(v * 120.0F), 120, 120, 3);
  const float edge = Step(0.0F, 0.15F, std::min(book.x, 1.0F - book.x));
  return {.light = edge * (0.25F + 0.75F * id) * (title > 0.8F ? 1.6F : 1.0F),
          .tint = 0.4F * Eigen::Vector3f::Ones() + 0.6F * Hue(id * 13.7F)};
}

Shade Fabric(float u, float v, const TileNoise& n) {
  const float checks = (std::sin(u * 6.2831853F * 24.0F) > 0.2F ? 0.35F : 0.0F) +
                       (std::sin(v * 6.2831853F * 24.0F) > 0.2F ? 0.35F : 0.0F);
  return {.light = 0.3F + checks, .gain = 0.6F + 0.8F * n.Fractal(u, v, 14, 6, 4, 1)};
}

using Pattern = Shade (*)(float u, float v, const TileNoise& noise);
// In the order of TexturePattern.
constexpr std::array<Pattern, 20> kPatterns = {
    Plain,   Plaster, Concrete, Bricks, StoneBlocks, Paving,    Tiles,  Asphalt, Rock,    Grass,
    Foliage, Bark,    Wood,     Carpet, Metal,       RoofTiles, Gravel, Posters, Shelves, Fabric};

}  // namespace

Texture DrawTexture(const TextureRecipe& recipe, int size, TextureTint tint) {
  const Pattern pattern = kPatterns.at(static_cast<std::size_t>(recipe.pattern));
  if (recipe.pattern == TexturePattern::kPlain) size = 1;
  const TileNoise noise(recipe.seed);
  const auto side = static_cast<std::size_t>(size);
  std::vector<Eigen::Vector3f> texels(side * side);
  ParallelFor(side, 16, [&](std::size_t row) {
    for (std::size_t column = 0; column < side; ++column) {
      const float u = (static_cast<float>(column) + 0.5F) / static_cast<float>(size);
      const float v = (static_cast<float>(row) + 0.5F) / static_cast<float>(size);
      const Shade shade = pattern(u, v, noise);
      const float light = std::clamp(shade.light, 0.0F, 1.3F);
      const Eigen::Vector3f mixed = recipe.dark + light * (recipe.light - recipe.dark);
      texels[row * side + column] = shade.gain * mixed.cwiseProduct(shade.tint);
    }
  });
  return Texture(size, texels, tint);
}

}  // namespace mlvi

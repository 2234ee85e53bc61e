// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/facade.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mlvi/sim/places/shapes.h"

namespace mlvi {
namespace {

constexpr double kBelow = 0.3;  // m, part of the wall below the ground

struct Wall {
  Eigen::Vector3d corner, along, out;
  double length = 0.0;

  Eigen::Vector3d At(double u, double v, double depth = 0.0) const {
    return corner + u * along + depth * out + Eigen::Vector3d(0.0, 0.0, v);
  }
};

// Openings that nearly line up do so: no slivers between them.
double WholeCentimetres(double metres) { return 0.01 * std::round(100.0 * metres); }

bool Overlaps(const PanelHole& a, const PanelHole& b) {
  constexpr double kMargin = 0.15;
  return a.u0 < b.u1 + kMargin && b.u0 < a.u1 + kMargin && a.v0 < b.v1 + kMargin &&
         b.v0 < a.v1 + kMargin;
}

// Adds `hole` if it fits between those that are there.
void AddIfFree(std::vector<PanelHole>& holes, const PanelHole& hole, const Wall& wall,
               double height) {
  if (hole.u0 < 0.2 || hole.u1 > wall.length - 0.2 || hole.v1 > height - 0.2) return;
  const bool taken = std::any_of(holes.begin(), holes.end(),
                                 [&](const PanelHole& other) { return Overlaps(hole, other); });
  if (!taken) holes.push_back(hole);
}

std::vector<PanelHole> Openings(const Wall& wall, const FacadeStyle& style,
                                const std::vector<PanelHole>& passages, RandomStream& random) {
  std::vector<PanelHole> holes = passages;
  const double height = style.height;
  for (int i = 0; i < style.doors; ++i) {
    const double u = random.Uniform(0.1, 0.9) * wall.length;
    AddIfFree(holes, {u - 0.7, u + 0.7, 0.02, 2.6, 0.4, false, style.door}, wall, height);
  }
  const int bays = std::max(1, static_cast<int>(wall.length / style.bay));
  for (int i = 0; i < bays; ++i) {
    const double centre =
        (i + 0.5 + random.Uniform(-0.1, 0.1)) * wall.length / static_cast<double>(bays);
    for (int floor = 0; style.storey * floor + 0.9 + style.window_height < height; ++floor) {
      const double sill = style.storey * floor + 0.9 + random.Uniform(-0.05, 0.05);
      const double half = 0.5 * style.window_width * random.Uniform(0.92, 1.08);
      if (random.Uniform() < style.missing) continue;
      AddIfFree(holes,
                {centre - half, centre + half, sill, sill + style.window_height, 0.22, false,
                 style.window},
                wall, height);
    }
  }
  return holes;
}

bool CrossesPassage(double u, double half, const std::vector<PanelHole>& passages) {
  return std::any_of(passages.begin(), passages.end(), [&](const PanelHole& hole) {
    return u + half > hole.u0 - 0.1 && u - half < hole.u1 + 0.1;
  });
}

// What stands out from the wall: string courses between the storeys, a cornice, window sills,
// buttresses, drain pipes.
void AddRelief(MeshBuilder& builder, const Wall& wall, const FacadeStyle& style,
               const std::vector<PanelHole>& holes, const std::vector<PanelHole>& passages,
               RandomStream& random) {
  const auto course = [&](double v, double depth, double height) {
    AddBeam(builder, wall.At(0.0, v, 0.5 * depth), wall.At(wall.length, v, 0.5 * depth), depth,
            height, style.trim);
  };
  course(style.height - 0.15, 0.45, 0.3);
  for (double v = style.storey; v < style.height - 1.0; v += style.storey) course(v, 0.12, 0.18);
  for (const PanelHole& hole : holes) {
    if (hole.open || hole.v0 < 0.5) continue;
    AddBeam(builder, wall.At(hole.u0 - 0.08, hole.v0 - 0.05, 0.06),
            wall.At(hole.u1 + 0.08, hole.v0 - 0.05, 0.06), 0.12, 0.1, style.trim);
  }
  const double yaw = std::atan2(wall.along.y(), wall.along.x());
  for (double u = style.bay; style.buttress > 0.0 && u < wall.length - 0.5; u += style.bay) {
    const double width = random.Uniform(0.35, 0.6), depth = style.buttress;
    if (random.Uniform() < 0.3 || CrossesPassage(u, width, holes)) continue;
    builder.AddBox(wall.At(u, -kBelow, 0.5 * depth), {width, depth, 0.75 * style.height}, yaw,
                   style.wall);
  }
  for (double u = random.Uniform(2.0, 8.0); u < wall.length; u += random.Uniform(9.0, 16.0)) {
    if (CrossesPassage(u, 0.1, passages)) continue;
    AddPipe(builder, wall.At(u, -kBelow, 0.1), wall.At(u, style.height - 0.4, 0.1), 0.055, 0.055, 8,
            style.trim);
  }
}

}  // namespace

void AddFacade(MeshBuilder& builder, const Eigen::Vector3d& corner, const Eigen::Vector3d& along,
               double length, const FacadeStyle& style, const std::vector<PanelHole>& passages,
               RandomStream& random) {
  const Wall wall{corner, along, along.cross(Eigen::Vector3d::UnitZ()), length};
  std::vector<PanelHole> holes = Openings(wall, style, passages, random);
  AddRelief(builder, wall, style, holes, passages, random);
  for (PanelHole& hole : holes) {
    hole.u0 = WholeCentimetres(hole.u0);
    hole.u1 = WholeCentimetres(hole.u1);
    hole.v0 = WholeCentimetres(hole.v0 + kBelow);
    hole.v1 = WholeCentimetres(hole.v1 + kBelow);
  }
  builder.AddPanel({.corner = wall.At(0.0, -kBelow),
                    .u = along,
                    .width = length,
                    .height = style.height + kBelow},
                   style.wall, holes);
}

void AddFacades(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector2d& size,
                bool inwards, const std::vector<FacadeStyle>& styles,
                const std::vector<std::vector<PanelHole>>& passages, RandomStream& random) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d high = low + size.x() * x + size.y() * y;
  const Eigen::Vector3d south_east = low + size.x() * x, north_west = low + size.y() * y;
  // South, east, north, west; seen from outside a wall runs to the right.
  const std::array<Eigen::Vector3d, 4> outside = {low, south_east, high, north_west};
  const std::array<Eigen::Vector3d, 4> inside = {south_east, high, north_west, low};
  const std::array<Eigen::Vector3d, 4> directions = {x, y, -x, -y};
  for (std::size_t side = 0; side < 4; ++side) {
    const double length = side % 2 == 0 ? size.x() : size.y();
    AddFacade(builder, inwards ? inside[side] : outside[side],
              inwards ? Eigen::Vector3d(-directions[side]) : directions[side], length,
              styles[side % styles.size()],
              side < passages.size() ? passages[side] : std::vector<PanelHole>(), random);
  }
}

}  // namespace mlvi

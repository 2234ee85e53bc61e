// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/places/terrain.h"

#include <array>
#include <cmath>
#include <numbers>

#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

using Index3 = std::array<int, 3>;

// Values of a field at the corners of a regular grid.
class Grid {
 public:
  Grid(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double cell,
       const DistanceField& distance)
      : low_(low), cell_(cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      corners_[axis] = static_cast<int>(std::ceil((high[i] - low[i]) / cell)) + 1;
    }
    values_.resize(static_cast<std::size_t>(corners_[0]) * static_cast<std::size_t>(corners_[1]) *
                   static_cast<std::size_t>(corners_[2]));
    ParallelFor(values_.size(), 4096, [&](std::size_t i) {
      values_[i] = static_cast<float>(distance(PointOf(CornerOf(i))));
    });
  }

  const Index3& corners() const { return corners_; }
  float Value(const Index3& c) const { return values_[Flat(c)]; }
  bool Inside(const Index3& c) const { return Value(c) < 0.0F; }
  std::size_t Flat(const Index3& c) const {
    return (static_cast<std::size_t>(c[2]) * static_cast<std::size_t>(corners_[1]) +
            static_cast<std::size_t>(c[1])) *
               static_cast<std::size_t>(corners_[0]) +
           static_cast<std::size_t>(c[0]);
  }
  Eigen::Vector3d PointOf(const Index3& c) const {
    return low_ + cell_ * Eigen::Vector3d(c[0], c[1], c[2]);
  }

  // Mean of the crossings on the edges of the cell whose lowest corner is `c`.
  Eigen::Vector3d CellVertex(const Index3& c) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int crossings = 0;
    for (int corner = 0; corner < 8; ++corner) {
      for (int axis = 0; axis < 3; ++axis) {
        if (corner >> axis & 1) continue;
        const Index3 a = {c[0] + (corner & 1), c[1] + (corner >> 1 & 1), c[2] + (corner >> 2)};
        Index3 b = a;
        ++b[static_cast<std::size_t>(axis)];
        if (Inside(a) == Inside(b)) continue;
        const double va = Value(a), vb = Value(b);
        sum += PointOf(a) + va / (va - vb) * (PointOf(b) - PointOf(a));
        ++crossings;
      }
    }
    return sum / std::max(crossings, 1);
  }

 private:
  Index3 CornerOf(std::size_t i) const {
    const auto x = static_cast<std::size_t>(corners_[0]), y = static_cast<std::size_t>(corners_[1]);
    return {static_cast<int>(i % x), static_cast<int>(i / x % y), static_cast<int>(i / (x * y))};
  }

  Eigen::Vector3d low_;
  double cell_;
  Index3 corners_{};
  std::vector<float> values_;
};

}  // namespace

void AddTerrain(MeshBuilder& builder, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                double cell, const HeightField& height, MaterialId material) {
  const int nx = static_cast<int>(std::ceil((high.x() - low.x()) / cell));
  const int ny = static_cast<int>(std::ceil((high.y() - low.y()) / cell));
  const auto at = [&](int i, int j) -> Eigen::Vector3d {
    const double x = low.x() + (high.x() - low.x()) * i / nx;
    const double y = low.y() + (high.y() - low.y()) * j / ny;
    return {x, y, height(x, y)};
  };
  for (int i = 0; i < nx; ++i) {
    for (int j = 0; j < ny; ++j)
      builder.AddQuad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1), material);
  }
}

void AddOval(MeshBuilder& builder, const Eigen::Vector2d& centre, const Eigen::Vector2d& radii,
             const HeightField& height, double kerb, MaterialId material,
             MaterialId kerb_material) {
  constexpr int kSectors = 64, kRings = 10;
  const auto at = [&](int ring, int sector, double drop = 0.0) -> Eigen::Vector3d {
    const double angle = 2.0 * std::numbers::pi * (sector % kSectors) / kSectors;
    const double share = static_cast<double>(ring) / kRings;
    const double x = centre.x() + share * radii.x() * std::cos(angle);
    const double y = centre.y() + share * radii.y() * std::sin(angle);
    return {x, y, height(x, y) - drop};
  };
  for (int i = 0; i < kSectors; ++i) {
    builder.AddTriangle(at(0, 0), at(1, i), at(1, i + 1), material);
    for (int ring = 1; ring < kRings; ++ring) {
      builder.AddQuad(at(ring, i), at(ring + 1, i), at(ring + 1, i + 1), at(ring, i + 1), material);
    }
    builder.AddQuad(at(kRings, i), at(kRings, i + 1), at(kRings, i + 1, kerb), at(kRings, i, kerb),
                    kerb_material);
  }
}

void AddIsosurface(MeshBuilder& builder, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                   double cell, const DistanceField& distance, MaterialId material) {
  const Grid grid(low, high, cell, distance);
  const Index3 n = grid.corners();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    Index3 c{};
    for (c[2] = axis == 2 ? 0 : 1; c[2] < n[2] - 1; ++c[2]) {
      for (c[1] = axis == 1 ? 0 : 1; c[1] < n[1] - 1; ++c[1]) {
        for (c[0] = axis == 0 ? 0 : 1; c[0] < n[0] - 1; ++c[0]) {
          Index3 next = c;
          ++next[axis];
          if (grid.Inside(c) == grid.Inside(next)) continue;
          // The four cells around this edge.
          const auto vertex = [&](int du, int dv) {
            Index3 lowest = c;
            lowest[u] -= du;
            lowest[v] -= dv;
            return grid.CellVertex(lowest);
          };
          builder.AddQuad(vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1), material);
        }
      }
    }
  }
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/mapping_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mlvi/sim/mesh_builder.h"

namespace mlvi {
namespace {

Eigen::Vector3f FlatNormal(const TriangleMesh& mesh, std::uint32_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                        &c = mesh.vertices[t[2]];
  return (b - a).cross(c - a).normalized();
}

TEST(MappingNormals, BoxesKeepTheirFaces) {
  MeshBuilder builder;
  builder.AddBox({1.0, 2.0, 0.0}, {1.0, 2.0, 3.0}, 0.4, builder.AddMaterial("grey", 0.5));
  const TriangleMesh mesh = std::move(builder).Finish();
  const MappingNormals normals(mesh);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3f flat = FlatNormal(mesh, i);
    EXPECT_EQ(normals.At(i, {0.2F, 0.3F}, flat), flat);
  }
}

// A column of 24 sides: at both ends of a side the normal is the cylinder's, and so the same for
// its two neighbours, however they are wound.
TEST(MappingNormals, TurnEvenlyRoundAColumn) {
  MeshBuilder builder;
  const MaterialId grey = builder.AddMaterial("grey", 0.5);
  constexpr int kSides = 24;
  const auto rim = [](int k, double z) {
    const double angle = 2.0 * std::numbers::pi * (k % kSides) / kSides;
    return Eigen::Vector3d(std::cos(angle), std::sin(angle), z);
  };
  for (int k = 0; k < kSides; ++k) {
    if (k % 2 == 0)
      builder.AddQuad(rim(k, 0), rim(k + 1, 0), rim(k + 1, 2), rim(k, 2), grey);
    else
      builder.AddQuad(rim(k, 0), rim(k, 2), rim(k + 1, 2), rim(k + 1, 0), grey);
  }
  const TriangleMesh mesh = std::move(builder).Finish();
  const MappingNormals normals(mesh);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      const Eigen::Vector2f at(corner == 1 ? 1.0F : 0.0F, corner == 2 ? 1.0F : 0.0F);
      const Eigen::Vector3f& p = mesh.vertices[mesh.triangles[i][static_cast<std::size_t>(corner)]];
      const Eigen::Vector3f outward = Eigen::Vector3f(p.x(), p.y(), 0.0F).normalized();
      const Eigen::Vector3f normal = normals.At(i, at, FlatNormal(mesh, i)).normalized();
      // Two triangles of one side meet at half of the corners: a third of 15 degrees at most.
      EXPECT_GT(std::abs(normal.dot(outward)), std::cos(0.05)) << i << ' ' << corner;
    }
  }
}

}  // namespace
}  // namespace mlvi

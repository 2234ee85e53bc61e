// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/mapping_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <span>

namespace mlvi {
namespace {

constexpr float kSmooth = 0.64F;  // cosine between facets that turn into one another
constexpr float kFlat = 0.9999F;  // and between those of a plane

// Triangles may be wound either way.
Eigen::Vector3f Turned(const Eigen::Vector3f& normal, const Eigen::Vector3f& like) {
  return normal.dot(like) < 0.0F ? Eigen::Vector3f(-normal) : normal;
}

// A corner of a triangle, to be found by its place: triangles need not share vertices.
struct Corner {
  std::array<float, 3> place;
  std::uint32_t triangle = 0, corner = 0;
};

std::vector<Corner> CornersByPlace(const TriangleMesh& mesh) {
  std::vector<Corner> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& p = mesh.vertices[mesh.triangles[i][k]];
      corners.push_back({{p.x(), p.y(), p.z()}, i, k});
    }
  }
  std::ranges::stable_sort(corners, {}, &Corner::place);
  return corners;
}

}  // namespace

MappingNormals::MappingNormals(const TriangleMesh& mesh) : curved_(mesh.triangles.size(), -1) {
  std::vector<Eigen::Vector3f> normals;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                          &c = mesh.vertices[t[2]];
    normals.push_back((b - a).cross(c - a).normalized());
  }
  const std::vector<Corner> corners = CornersByPlace(mesh);
  for (std::size_t begin = 0, end = 0; begin < corners.size(); begin = end) {
    while (end < corners.size() && corners[end].place == corners[begin].place) ++end;
    const auto around = std::span(corners).subspan(begin, end - begin);
    for (const Corner& corner : around) {
      const Eigen::Vector3f& own = normals[corner.triangle];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      bool flat = true;
      for (const Corner& other : around) {
        const Eigen::Vector3f normal = Turned(normals[other.triangle], own);
        if (normal.dot(own) < kSmooth) continue;
        sum += normal;
        flat = flat && normal.dot(own) > kFlat;
      }
      if (flat) continue;
      std::int32_t& index = curved_[corner.triangle];
      if (index < 0) {
        index = static_cast<std::int32_t>(corners_.size());
        corners_.push_back({own, own, own});
      }
      corners_[static_cast<std::size_t>(index)][corner.corner] = sum.normalized();
    }
  }
}

}  // namespace mlvi

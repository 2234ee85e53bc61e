// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace mlvi {

// What a surface is made of. Textures of simulated cameras will find their place here.
struct Material {
  std::string name;
  double reflectivity =
      0.5;  // of the LiDAR's wavelength at normal incidence, Lambertian, in [0, 1]
};

// Triangles in the world frame (z up, m), seen from both sides.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> triangle_materials;  // index into materials, one per triangle
  std::vector<Material> materials;
};

struct SurfaceHit {
  double range = 0.0;                                // m along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, on the side that the ray comes from
  const Material* material = nullptr;                // owned by the world
};

// A static scene for ray tracing. Const functions are thread-safe and give the same bits on every
// call.
class World {
 public:
  explicit World(TriangleMesh mesh);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const TriangleMesh& mesh() const;

  // The first surface from `origin` along the unit vector `direction`, not farther than
  // `max_range`.
  std::optional<SurfaceHit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double max_range) const;
  // Distance to the nearest surface as seen by rays in all directions (200 of them, evenly spread),
  // or `max_range` when none comes closer. Thin objects between two rays can be missed.
  double Clearance(const Eigen::Vector3d& point, double max_range) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace mlvi

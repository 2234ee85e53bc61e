// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "mlvi/sim/irradiance_cache.h"
#include "mlvi/sim/world.h"

namespace mlvi {

// The light that comes along one ray, and what the ray met: enough to tell edges in an image.
struct RayLight {
  Eigen::Vector3f luminance = Eigen::Vector3f::Zero();  // cd/m^2 by colour: red, green, blue
  float range = 0.0F;                                   // m; 0: the sky
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();     // unit, world
  float plane = 0.0F;                                   // m, from the origin to the tangent plane
  std::uint32_t surface = 0;  // tells material, moving object and whether the sun shines on it
};

// What light does in a world: textures, sun with hard shadows, sky and lamps with soft ones
// (IrradianceCache), mirrors and panes. Draws the textures when constructed. Const functions are
// thread-safe and give the same bits on every call.
class SceneRenderer {
 public:
  // `world` must outlive the renderer.
  explicit SceneRenderer(const World& world);

  const World& world() const { return *world_; }

  // The world and its light at one instant.
  struct Moment {
    WorldSnapshot snapshot;
    double lamp_level = 1.0;
    Eigen::Vector3d carried_lamp = Eigen::Vector3d::Zero();  // m, world
    std::vector<double> sky_shares;  // seen by the moving objects, of the open sky, each in [0, 1]
  };
  Moment At(Time time, const Eigen::Vector3d& carried_lamp) const;

  // Along the unit `direction` from `origin` (world). `pixel_angle`, rad: the width of the cone
  // that the ray stands for; textures are filtered to it.
  RayLight Trace(const Moment& moment, const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction, double pixel_angle) const;

 private:
  struct Surface {
    std::shared_ptr<const Texture> texture;
    float mean_albedo = 0.0F;
  };
  // A point on a surface in the frame of its mesh, and the cone that looks at it.
  struct Spot {
    const TriangleMesh* mesh = nullptr;
    const Material* material = nullptr;
    const Texture* texture = nullptr;
    std::uint32_t triangle = 0;
    Eigen::Vector2f barycentric = Eigen::Vector2f::Zero();
    Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
    Eigen::Vector3f stretch = Eigen::Vector3f::Zero();  // m, the long axis of the cone's footprint
    float width = 0.0F;                                 // m, its short axis
  };
  RayLight Follow(const Moment& moment, const Eigen::Vector3d& origin,
                  const Eigen::Vector3d& direction, double pixel_angle, double travelled,
                  int depth) const;
  Spot SpotOf(const Moment& moment, const SurfaceHit& hit, const Eigen::Vector3d& direction,
              double width) const;
  Eigen::Vector3f Albedo(const Spot& spot) const;
  Eigen::Vector3f PlanarAlbedo(const Spot& spot, const Eigen::Vector2f& uv,
                               const Eigen::Vector2f& stretch, float width) const;
  // Illuminance, lux, and whether the sun shines on it.
  float Illuminance(const Moment& moment, const SurfaceHit& hit, const Eigen::Vector3d& point,
                    bool& sunlit) const;
  const std::vector<Surface>& SurfacesOf(const SurfaceHit& hit) const;

  const World* world_;
  std::vector<std::vector<Surface>> surfaces_;  // by mesh: the world's, then of all parts in order
  std::vector<std::size_t> first_parts_;        // index in surfaces_ of each object's first part
  Texture patches_;                             // large faint stains that break repetition
  std::unique_ptr<IrradianceCache> irradiance_;
};

}  // namespace mlvi

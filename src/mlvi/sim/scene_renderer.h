// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "mlvi/sim/irradiance_cache.h"
#include "mlvi/sim/mapping_normals.h"
#include "mlvi/sim/world.h"

namespace mlvi {

// What a ray of a camera met: enough to tell edges in an image, and to compute the light later.
struct Sight {
  PacketHit hit;              // its range is 0 for the sky
  float plane = 0.0F;         // m, from the origin to the tangent plane
  std::uint32_t surface = 0;  // tells material, moving object and whether the sun shines on it
  bool sunlit = false;
};

// Whether two neighbouring rays met the same smooth surface under the same sun.
bool SameSurface(const Sight& a, const Sight& b);

// What light does in a world: textures, sun with hard shadows, sky and lamps with soft ones
// (IrradianceCache), mirrors and panes. First what rays meet (Look, in packets), then what light
// comes from there (Shade, many rays at once, so that what mirrors and panes show is traced in
// packets, too): rays that meet the same surface share one shade. Draws the textures when
// constructed. Const functions are thread-safe and give the same bits on every call.
class SceneRenderer {
 public:
  // `world` must outlive the renderer. Grey, luminances are right and colours are not.
  explicit SceneRenderer(const World& world, TextureTint tint = TextureTint::kColour);

  const World& world() const { return *world_; }

  // The world and its light at one instant.
  struct Moment {
    WorldSnapshot snapshot;
    double lamp_level = 1.0;
    Eigen::Vector3d carried_lamp = Eigen::Vector3d::Zero();  // m, world
    std::vector<double> sky_shares;  // seen by the moving objects, of the open sky, each in [0, 1]
  };
  Moment At(Time time, const Eigen::Vector3d& carried_lamp) const;
  // The same for an instant within the exposure of `like`: what changes slowly is taken from there.
  Moment At(Time time, const Eigen::Vector3d& carried_lamp, const Moment& like) const;

  // How a camera moves during an exposure, relative to what it sees.
  struct ExposureMotion {
    const Moment *begin = nullptr, *middle = nullptr, *end = nullptr;
    Pose3 T_begin_world, T_end_world;                              // of the camera
    Eigen::Vector3d position = Eigen::Vector3d::Zero();            // m, world, in the middle
    Eigen::Matrix3f R_world_camera = Eigen::Matrix3f::Identity();  // in the middle
    // Displacement of a static point at position + y: turn * y + shift.
    Eigen::Matrix3f turn = Eigen::Matrix3f::Zero();
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();
    float turn_norm = 0.0F, shift_norm = 0.0F;
  };
  static ExposureMotion MakeExposureMotion(const std::array<const Moment*, 3>& moments,
                                           const std::array<Pose3, 3>& T_world_camera);
  // How far what `hit` is about, at position + `y` in the middle of the exposure, moves during it
  // as the camera sees it; m, in axes of the world.
  Eigen::Vector3f Displacement(const ExposureMotion& motion, const PacketHit& hit,
                               const Eigen::Vector3f& y) const;

  // A cone of light through a pixel.
  struct View {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();      // world
    Eigen::Vector3f direction = Eigen::Vector3f::UnitX();  // unit, world
    float pixel_angle = 0.0F;  // rad, the cone's width: textures are filtered to it
    // Textures are smeared by this share of what moves during the exposure; null: none.
    const ExposureMotion* motion = nullptr;
    float share = 1.0F;
  };
  // What the rays of a packet meet, each at its own moment.
  using Moments = std::array<const Moment*, WideRayPacket::kSize>;
  using Sights = std::array<Sight, WideRayPacket::kSize>;
  Sights Look(const WideRayPacket& rays, const Moments& moments) const;

  // A ray, what it met, and which pixel its light counts for.
  struct LightRay {
    const Moment* moment = nullptr;
    View view;
    Sight sight;
    std::size_t pixel = 0;
    float weight = 1.0F;
    float travelled = 0.0F;  // m, up to the view's origin: by way of mirrors and panes
  };
  // Adds the luminance that comes along every ray, times its weight, to that of its pixel; cd/m^2
  // by colour: red, green, blue.
  void Shade(std::vector<LightRay> rays, std::span<Eigen::Vector3f> pixels) const;

  // All of it for one ray.
  struct RayLight {
    Eigen::Vector3f luminance = Eigen::Vector3f::Zero();
    float range = 0.0F;  // m; 0: the sky
  };
  RayLight Trace(const Moment& moment, const View& view) const;

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
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();   // from where the texture is laid on
    Eigen::Vector3f stretch = Eigen::Vector3f::Zero();  // m, the long axis of the cone's footprint
    float width = 0.0F;                                 // m, its short axis
  };
  struct OnwardRays;  // from mirrors and panes
  void LookAlong(std::vector<LightRay>& rays) const;
  Eigen::Vector3f SkyLight(const View& view) const;
  Eigen::Vector3f Scattered(const LightRay& ray) const;
  float GoOnward(const LightRay& ray, OnwardRays& onward) const;
  const TriangleMesh& MeshOf(const PacketHit& hit) const;
  const Material& MaterialOf(const PacketHit& hit) const;
  Spot SpotOf(const Moment& moment, const View& view, const Sight& sight, float way) const;
  Eigen::Vector3f Smear(const View& view, const Sight& sight) const;
  Eigen::Vector3f Albedo(const Spot& spot) const;
  Eigen::Vector3f PlanarAlbedo(const Spot& spot, const Eigen::Vector2f& uv,
                               const Eigen::Vector2f& stretch, float width) const;
  float Illuminance(const Moment& moment, const View& view, const Sight& sight) const;  // lux
  std::size_t MeshIndexOf(const PacketHit& hit) const;  // 0: the world's

  const World* world_;
  // By mesh: the world's, then of all parts in order.
  std::vector<std::vector<Surface>> surfaces_;
  std::vector<MappingNormals> normals_;
  std::vector<std::size_t> first_parts_;  // index in surfaces_ of each object's first part
  Texture patches_;                       // large faint stains that break repetition
  std::unique_ptr<IrradianceCache> irradiance_;
};

}  // namespace mlvi

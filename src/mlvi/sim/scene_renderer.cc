// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/scene_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "mlvi/sim/sky.h"
#include "mlvi/sim/texture_patterns.h"
#include "mlvi/sim/tile_noise.h"

namespace mlvi {
namespace {

constexpr double kFar = 1000.0;        // m
constexpr double kOffTheWall = 0.002;  // m
constexpr int kMaxDepth = 3;           // mirrors and panes on one ray
constexpr float kPatchTile = 23.7F;    // m, no multiple of any texture's
constexpr int kMaxTaps = 5;            // samples along the long axis of a footprint
constexpr float kPi = std::numbers::pi_v<float>;

Texture DrawPatches() {
  constexpr int kSize = 256;
  const internal::TileNoise noise(99);
  std::vector<Eigen::Vector3f> texels;
  for (int row = 0; row < kSize; ++row) {
    for (int column = 0; column < kSize; ++column) {
      const float u = static_cast<float>(column) / kSize, v = static_cast<float>(row) / kSize;
      texels.push_back(Eigen::Vector3f::Constant(noise.Fractal(u, v, 8, 8, 5, 1)));
    }
  }
  return Texture(kSize, texels);
}

bool SameRecipe(const TextureRecipe& a, const TextureRecipe& b) {
  return a.pattern == b.pattern && a.seed == b.seed && a.light == b.light && a.dark == b.dark;
}

// Draws every distinct recipe once.
class TextureStore {
 public:
  std::shared_ptr<const Texture> Get(const Material& material) {
    if (material.image) return material.image;
    for (const auto& [recipe, texture] : drawn_) {
      if (SameRecipe(recipe, material.texture)) return texture;
    }
    auto texture = std::make_shared<const Texture>(DrawTexture(material.texture));
    drawn_.emplace_back(material.texture, texture);
    return texture;
  }

 private:
  std::vector<std::pair<TextureRecipe, std::shared_ptr<const Texture>>> drawn_;
};

// Reflectance at the angle of incidence (Schlick 1994).
double Mirrored(const Material& material, double cosine) {
  const double x = 1.0 - std::min(1.0, cosine);
  return material.mirror + (1.0 - material.mirror) * x * x * x * x * x;
}

std::uint32_t SurfaceCode(const SurfaceHit& hit, const TriangleMesh& mesh, bool sunlit) {
  const auto material = static_cast<std::uint32_t>(hit.material - mesh.materials.data());
  const auto object = static_cast<std::uint32_t>(hit.object + 1);
  return (material << 1 | (sunlit ? 1U : 0U)) + (object << 14) +
         (static_cast<std::uint32_t>(hit.part) << 26) + 1;
}

}  // namespace

SceneRenderer::SceneRenderer(const World& world) : world_(&world), patches_(DrawPatches()) {
  TextureStore store;
  const auto add = [&](const TriangleMesh& mesh) {
    auto& surfaces = surfaces_.emplace_back();
    std::vector<bool> used(mesh.materials.size());
    for (const std::uint16_t material : mesh.triangle_materials) used[material] = true;
    for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
      if (!used[i]) {
        surfaces.emplace_back();
        continue;
      }
      auto texture = store.Get(mesh.materials[i]);
      const float mean = texture->Sample(0.5F, 0.5F, static_cast<float>(texture->levels())).mean();
      surfaces.push_back({std::move(texture), mean});
    }
  };
  add(world.mesh());
  for (const MovingObject& mover : world.movers()) {
    first_parts_.push_back(surfaces_.size());
    for (const TriangleMesh& part : mover.parts) add(part);
  }
  std::vector<float> albedos;
  for (const Surface& surface : surfaces_.front()) albedos.push_back(surface.mean_albedo);
  irradiance_ = std::make_unique<IrradianceCache>(world, std::move(albedos));
}

SceneRenderer::Moment SceneRenderer::At(Time time, const Eigen::Vector3d& carried_lamp) const {
  const Lighting& light = world_->lighting();
  Moment moment{.snapshot = world_->At(time), .carried_lamp = carried_lamp};
  if (light.lamp_level) moment.lamp_level = light.lamp_level(moment.snapshot.seconds());
  const WorldSnapshot still = world_->StaticSnapshot();
  constexpr int kRays = 12;
  for (int i = 0; i < static_cast<int>(world_->movers().size()); ++i) {
    const Eigen::Vector3d middle = moment.snapshot.PoseOf(i, 0).translation();
    double open = 0.0;
    for (int k = 0; k < kRays; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kRays, slope = k % 2 == 0 ? 0.5 : 0.85;
      const Eigen::Vector3d direction(std::cos(angle) * std::sqrt(1.0 - slope * slope),
                                      std::sin(angle) * std::sqrt(1.0 - slope * slope), slope);
      open += still.Occluded(middle, direction, kFar) ? 0.0 : 1.0 / kRays;
    }
    moment.sky_shares.push_back(open);
  }
  return moment;
}

RayLight SceneRenderer::Trace(const Moment& moment, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& direction, double pixel_angle) const {
  return Follow(moment, origin, direction, pixel_angle, 0.0, 0);
}

RayLight SceneRenderer::Follow(const Moment& moment, const Eigen::Vector3d& origin,
                               const Eigen::Vector3d& direction, double pixel_angle,
                               double travelled, int depth) const {
  RayLight result;
  const auto hit = moment.snapshot.Cast(origin, direction, kFar);
  if (!hit) {
    const auto sky = static_cast<float>(SkyAndSunLuminance(world_->lighting(), direction));
    const float blue = direction.z() > 0.0 ? 0.15F : 0.0F;
    result.luminance = {(1.0F - blue) * sky, sky, (1.0F + blue) * sky};
    return result;
  }
  const Eigen::Vector3d point = origin + hit->range * direction;
  const double cosine = -hit->normal.dot(direction), way = travelled + hit->range;
  const Material& material = *hit->material;
  bool sunlit = false;
  const float illuminance = Illuminance(moment, *hit, point, sunlit);
  const Spot spot = SpotOf(moment, *hit, direction, way * pixel_angle);
  result.luminance = illuminance / kPi * Albedo(spot) +
                     Eigen::Vector3f::Constant(static_cast<float>(material.emission));
  result.range = static_cast<float>(hit->range);
  result.normal = hit->normal.cast<float>();
  result.plane = static_cast<float>(hit->range * cosine);
  result.surface = SurfaceCode(*hit, *spot.mesh, sunlit);
  const bool smooth = material.mirror > 0.0 || material.transmission > 0.0;
  if (!smooth || depth + 1 >= kMaxDepth) return result;

  const double mirrored = Mirrored(material, cosine);
  const double passed = material.transmission * (1.0 - mirrored) / (1.0 - material.mirror);
  result.luminance *= static_cast<float>(1.0 - mirrored - passed);
  const auto add = [&](double share, const Eigen::Vector3d& onward, double side) {
    if (share < 0.01) return;
    const Eigen::Vector3d from = point + side * kOffTheWall * hit->normal;
    result.luminance += static_cast<float>(share) *
                        Follow(moment, from, onward, pixel_angle, way, depth + 1).luminance;
  };
  add(mirrored, direction + 2.0 * cosine * hit->normal, 1.0);
  add(passed, direction, -1.0);
  return result;
}

const std::vector<SceneRenderer::Surface>& SceneRenderer::SurfacesOf(const SurfaceHit& hit) const {
  if (hit.object < 0) return surfaces_.front();
  return surfaces_[first_parts_[static_cast<std::size_t>(hit.object)] +
                   static_cast<std::size_t>(hit.part)];
}

SceneRenderer::Spot SceneRenderer::SpotOf(const Moment& moment, const SurfaceHit& hit,
                                          const Eigen::Vector3d& direction, double width) const {
  const bool moves = hit.object >= 0;
  const TriangleMesh& mesh = moves ? world_->movers()[static_cast<std::size_t>(hit.object)]
                                         .parts[static_cast<std::size_t>(hit.part)]
                                   : world_->mesh();
  const auto& t = mesh.triangles[hit.triangle];
  const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                        &c = mesh.vertices[t[2]];
  Spot spot{.mesh = &mesh,
            .material = hit.material,
            .triangle = hit.triangle,
            .barycentric = hit.barycentric,
            .point = a + hit.barycentric.x() * (b - a) + hit.barycentric.y() * (c - a),
            .normal = hit.normal.cast<float>(),
            .width = static_cast<float>(width)};
  spot.texture =
      SurfacesOf(hit)[static_cast<std::size_t>(hit.material - mesh.materials.data())].texture.get();
  Eigen::Vector3f looking = direction.cast<float>();
  if (moves) {
    const Eigen::Quaternionf R_part_world =
        moment.snapshot.PoseOf(hit.object, hit.part).rotation().conjugate().cast<float>();
    spot.normal = R_part_world * spot.normal;
    looking = R_part_world * looking;
  }
  const float cosine = std::max(0.02F, -spot.normal.dot(looking));
  const Eigen::Vector3f along = looking + cosine * spot.normal;
  const float length = along.norm();
  if (length > 1e-3F) spot.stretch = (spot.width / cosine / length) * along;
  return spot;
}

Eigen::Vector3f SceneRenderer::Albedo(const Spot& spot) const {
  const auto tile = static_cast<float>(spot.material->tile);
  if (spot.texture->size() == 1) return spot.texture->Sample(0.0F, 0.0F, 0.0F);
  const auto& uvs = spot.mesh->texture_coordinates;
  if (spot.material->mapping == TextureMapping::kVertex && !uvs.empty()) {
    const auto& t = spot.mesh->triangles[spot.triangle];
    const auto& vertices = spot.mesh->vertices;
    const Eigen::Vector3f ab = vertices[t[1]] - vertices[t[0]],
                          ac = vertices[t[2]] - vertices[t[0]];
    const Eigen::Vector2f uv_ab = uvs[t[1]] - uvs[t[0]], uv_ac = uvs[t[2]] - uvs[t[0]];
    // The footprint's long axis in texture coordinates: least squares over the triangle's edges.
    Eigen::Matrix<float, 3, 2> edges;
    edges << ab, ac;
    const Eigen::Vector2f share =
        (edges.transpose() * edges).inverse() * (edges.transpose() * spot.stretch);
    const float area = ab.cross(ac).norm();
    const float scale =
        std::sqrt(std::abs(uv_ab.x() * uv_ac.y() - uv_ab.y() * uv_ac.x()) / std::max(area, 1e-12F));
    const Eigen::Vector2f uv =
        uvs[t[0]] + spot.barycentric.x() * uv_ab + spot.barycentric.y() * uv_ac;
    return PlanarAlbedo(spot, uv / tile, (share.x() * uv_ab + share.y() * uv_ac) / tile,
                        spot.width * scale / tile);
  }
  // Along each axis of the mesh's frame: u, v and the signs that keep v down.
  constexpr std::array<std::array<int, 2>, 3> kAxes = {{{1, 2}, {0, 2}, {0, 1}}};
  Eigen::Array3f weights = (spot.normal.array().abs() - 0.35F).max(0.0F).pow(3);
  weights /= weights.sum();
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (weights[axis] < 0.01F) continue;
    const auto [u, v] = kAxes[static_cast<std::size_t>(axis)];
    const Eigen::Vector2f uv(spot.point[u], -spot.point[v]);
    const Eigen::Vector2f stretch(spot.stretch[u], -spot.stretch[v]);
    const float stain = patches_
                            .Sample(uv.x() / kPatchTile, uv.y() / kPatchTile,
                                    std::log2(std::max(1.0F, spot.width * 256.0F / kPatchTile)))
                            .x();
    albedo += weights[axis] * (0.6F + 0.8F * stain) *
              PlanarAlbedo(spot, uv / tile, stretch / tile, spot.width / tile);
  }
  return albedo;
}

// The mean of the texture over an ellipse with the half axes `stretch` and `width` (in repeats):
// samples along the long one, each filtered to the short one.
Eigen::Vector3f SceneRenderer::PlanarAlbedo(const Spot& spot, const Eigen::Vector2f& uv,
                                            const Eigen::Vector2f& stretch, float width) const {
  const float length = std::max(stretch.norm(), width);
  const int taps = std::clamp(static_cast<int>(std::ceil(0.6F * length / width)), 1, kMaxTaps);
  const float filter = std::max(width, length / static_cast<float>(taps));
  const float lod = std::log2(std::max(1e-6F, filter * static_cast<float>(spot.texture->size())));
  if (taps == 1) return spot.texture->Sample(uv.x(), uv.y(), lod);
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = 0; i < taps; ++i) {
    const float offset = (static_cast<float>(i) + 0.5F) / static_cast<float>(taps) - 0.5F;
    const Eigen::Vector2f at = uv + offset * stretch;
    sum += spot.texture->Sample(at.x(), at.y(), lod);
  }
  return sum / static_cast<float>(taps);
}

float SceneRenderer::Illuminance(const Moment& moment, const SurfaceHit& hit,
                                 const Eigen::Vector3d& point, bool& sunlit) const {
  const Lighting& light = world_->lighting();
  const Eigen::Vector3d above = point + kOffTheWall * hit.normal;
  double lux = light.ambient_illuminance;
  const double facing = hit.normal.dot(light.sun_direction);
  if (light.sun_illuminance > 0.0 && facing > 0.0) {
    sunlit = !moment.snapshot.Occluded(above, light.sun_direction, kFar);
    if (sunlit) lux += facing * light.sun_illuminance;
  }
  if (hit.object < 0) {
    const auto soft = irradiance_->At(hit.triangle, hit.barycentric, hit.normal);
    lux += soft.sky + moment.lamp_level * soft.lamps;
  } else {
    const double share = moment.sky_shares[static_cast<std::size_t>(hit.object)];
    lux += share * (0.6 + 0.4 * hit.normal.z()) * light.sky_illuminance;
    for (const PointLamp& lamp : light.lamps) {
      const Eigen::Vector3d way = lamp.position - point;
      // Half of it comes round by walls and ceiling, whatever way the surface faces.
      const double cosine = 0.5 + 0.5 * std::max(0.0, hit.normal.dot(way.normalized()));
      if (way.squaredNorm() < 100.0)
        lux += moment.lamp_level * lamp.intensity * cosine / std::max(0.25, way.squaredNorm());
    }
  }
  if (light.carried_lamp_intensity > 0.0) {
    const Eigen::Vector3d way = moment.carried_lamp - point;
    const double distance2 = std::max(0.01, way.squaredNorm());
    lux += light.carried_lamp_intensity * std::max(0.0, hit.normal.dot(way)) /
           (distance2 * std::sqrt(distance2));
  }
  return static_cast<float>(lux);
}

}  // namespace mlvi

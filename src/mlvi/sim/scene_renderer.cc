// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/scene_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
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
constexpr float kCoherent = 0.95F;     // cosine between rays that are traced as one bundle
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
  return Texture(kSize, texels, TextureTint::kGrey);
}

bool SameRecipe(const TextureRecipe& a, const TextureRecipe& b) {
  return a.pattern == b.pattern && a.seed == b.seed && a.light == b.light && a.dark == b.dark;
}

// Draws every distinct recipe once.
class TextureStore {
 public:
  explicit TextureStore(TextureTint tint) : tint_(tint) {}

  std::shared_ptr<const Texture> Get(const Material& material) {
    if (material.image) return material.image;
    for (const auto& [recipe, texture] : drawn_) {
      if (SameRecipe(recipe, material.texture)) return texture;
    }
    auto texture =
        std::make_shared<const Texture>(DrawTexture(material.texture, kTextureSize, tint_));
    drawn_.emplace_back(material.texture, texture);
    return texture;
  }

 private:
  TextureTint tint_;
  std::vector<std::pair<TextureRecipe, std::shared_ptr<const Texture>>> drawn_;
};

std::uint32_t SurfaceCode(const PacketHit& hit, std::uint16_t material, bool sunlit) {
  const auto object = static_cast<std::uint32_t>(hit.object + 1);
  return (std::uint32_t{material} << 1 | (sunlit ? 1U : 0U)) + (object << 14) +
         (static_cast<std::uint32_t>(hit.part) << 26) + 1;
}

// log2 of x >= 1 within 0.009, for levels of pyramids: the exponent, and a parabola through the
// mantissa.
float Log2(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x7fffffU) | 0x3f800000U) - 1.0F;
  return exponent + m * (1.3465F - 0.3465F * m);
}

// Trilinear filtering costs twice as much as bilinear: only half of the way from one level of a
// pyramid to the next blends them.
float BlendLess(float lod) {
  const auto level = static_cast<float>(static_cast<int>(lod));  // lod >= 0
  return level + std::clamp(2.0F * (lod - level) - 0.5F, 0.0F, 1.0F);
}

// The half axes of an ellipse in the plane across `normal`: its covariance is that of the given
// one, (stretch, width across), and of `smear` together.
void AddSmear(const Eigen::Vector3f& normal, const Eigen::Vector3f& smear, Eigen::Vector3f& stretch,
              float& width) {
  const float length = stretch.norm();
  const Eigen::Vector3f u =
      length > 1e-6F ? Eigen::Vector3f(stretch / length) : Eigen::Vector3f(smear.normalized());
  const Eigen::Vector3f v = normal.cross(u);
  const float along = std::max(length, width), su = smear.dot(u), sv = smear.dot(v);
  const float a = along * along + su * su, b = su * sv, c = width * width + sv * sv;
  const float middle = 0.5F * (a + c), swing = std::hypot(0.5F * (a - c), b);
  const float angle = 0.5F * std::atan2(2.0F * b, a - c);
  stretch = std::sqrt(middle + swing) * (std::cos(angle) * u + std::sin(angle) * v);
  width = std::sqrt(std::max(middle - swing, 1e-12F));
}

}  // namespace

bool SameSurface(const Sight& a, const Sight& b) {
  if (a.surface != b.surface) return false;
  if (a.hit.range == 0.0F) return true;
  if (a.hit.normal.dot(b.hit.normal) < 0.97F) return false;
  // The same on a plane, at any grazing angle.
  return std::abs(a.plane - b.plane) < 0.01F + 0.01F * std::min(a.hit.range, b.hit.range);
}

SceneRenderer::SceneRenderer(const World& world, TextureTint tint)
    : world_(&world), patches_(DrawPatches()) {
  TextureStore store(tint);
  const auto add = [&](const TriangleMesh& mesh) {
    auto& surfaces = surfaces_.emplace_back();
    normals_.emplace_back(mesh);
    std::vector<bool> used(mesh.materials.size());
    for (const std::uint16_t material : mesh.triangle_materials) used[material] = true;
    for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
      if (!used[i]) {
        surfaces.emplace_back();
        continue;
      }
      auto texture = store.Get(mesh.materials[i]);
      const float mean = texture->mean();
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

SceneRenderer::Moment SceneRenderer::At(Time time, const Eigen::Vector3d& carried_lamp,
                                        const Moment& like) const {
  return {.snapshot = world_->At(time),
          .lamp_level = like.lamp_level,
          .carried_lamp = carried_lamp,
          .sky_shares = like.sky_shares};
}

SceneRenderer::ExposureMotion SceneRenderer::MakeExposureMotion(
    const std::array<const Moment*, 3>& moments, const std::array<Pose3, 3>& T_world_camera) {
  ExposureMotion motion{.begin = moments[0],
                        .middle = moments[1],
                        .end = moments[2],
                        .T_begin_world = T_world_camera[0].inverse(),
                        .T_end_world = T_world_camera[2].inverse(),
                        .position = T_world_camera[1].translation(),
                        .R_world_camera = T_world_camera[1].R().cast<float>()};
  const Eigen::Matrix3d R = T_world_camera[1].R();
  motion.turn = (R * (motion.T_end_world.R() - motion.T_begin_world.R())).cast<float>();
  motion.shift =
      (R * (motion.T_end_world * motion.position - motion.T_begin_world * motion.position))
          .cast<float>();
  motion.turn_norm = motion.turn.norm();
  motion.shift_norm = motion.shift.norm();
  return motion;
}

Eigen::Vector3f SceneRenderer::Displacement(const ExposureMotion& motion, const PacketHit& hit,
                                            const Eigen::Vector3f& y) const {
  if (hit.range == 0.0F) return motion.turn * y;
  if (hit.object < 0) return motion.turn * y + motion.shift;
  const Eigen::Vector3d point = motion.position + y.cast<double>();
  const auto pose = [&](const Moment* moment) -> const Pose3& {
    return moment->snapshot.PoseOf(hit.object, hit.part);
  };
  const Eigen::Vector3d in_part = pose(motion.middle).inverse() * point;
  const Eigen::Vector3d moved = motion.T_end_world * (pose(motion.end) * in_part) -
                                motion.T_begin_world * (pose(motion.begin) * in_part);
  return motion.R_world_camera * moved.cast<float>();
}

SceneRenderer::Sights SceneRenderer::Look(const WideRayPacket& rays, const Moments& moments) const {
  WorldSnapshot::PerRayOf<WideRayPacket::kSize> snapshots;
  for (std::size_t i = 0; i < moments.size(); ++i) snapshots[i] = &moments[i]->snapshot;
  const auto hits = WorldSnapshot::Cast(rays, snapshots);
  const Lighting& light = world_->lighting();
  const Eigen::Vector3f sun = light.sun_direction.cast<float>();
  WideRayPacket to_sun;
  to_sun.coherent = rays.coherent;
  for (int i = 0; i < rays.kSize && light.sun_illuminance > 0.0; ++i) {
    const PacketHit& hit = hits[static_cast<std::size_t>(i)];
    if (hit.range == 0.0F || hit.normal.dot(sun) <= 0.0F) continue;
    to_sun.Set(i,
               rays.Origin(i) + hit.range * rays.Direction(i) +
                   static_cast<float>(kOffTheWall) * hit.normal,
               sun, static_cast<float>(kFar));
  }
  const unsigned sunlit =
      to_sun.active == 0 ? 0 : to_sun.active & ~WorldSnapshot::Occluded(to_sun, snapshots);
  Sights sights;
  for (int i = 0; i < rays.kSize; ++i) {
    const PacketHit& hit = hits[static_cast<std::size_t>(i)];
    if (hit.range == 0.0F) continue;
    const bool lit = (sunlit >> i & 1U) != 0;
    sights[static_cast<std::size_t>(i)] = {
        .hit = hit,
        .plane = -hit.range * hit.normal.dot(rays.Direction(i)),
        .surface = SurfaceCode(hit, MeshOf(hit).triangle_materials[hit.triangle], lit),
        .sunlit = lit};
  }
  return sights;
}

// Fills in the sights.
void SceneRenderer::LookAlong(std::vector<LightRay>& rays) const {
  constexpr std::size_t kSize = WideRayPacket::kSize;
  for (std::size_t first = 0; first < rays.size(); first += kSize) {
    const auto batch = std::span(rays).subspan(first, std::min(kSize, rays.size() - first));
    WideRayPacket packet;
    Moments moments;
    moments.fill(batch.front().moment);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const View& view = batch[i].view;
      packet.Set(static_cast<int>(i), view.origin.cast<float>(), view.direction,
                 static_cast<float>(kFar));
      packet.coherent =
          packet.coherent && view.direction.dot(batch.front().view.direction) > kCoherent;
      moments[i] = batch[i].moment;
    }
    const Sights sights = Look(packet, moments);
    for (std::size_t i = 0; i < batch.size(); ++i) batch[i].sight = sights[i];
  }
}

SceneRenderer::RayLight SceneRenderer::Trace(const Moment& moment, const View& view) const {
  std::vector<LightRay> rays = {{.moment = &moment, .view = view}};
  LookAlong(rays);
  RayLight light{.range = rays.front().sight.hit.range};
  Shade(std::move(rays), {&light.luminance, 1});
  return light;
}

// Those that are mirrored and those that pass, apart: each keep to much the same way.
struct SceneRenderer::OnwardRays {
  std::vector<LightRay> mirrored, passed;
};

void SceneRenderer::Shade(std::vector<LightRay> rays, std::span<Eigen::Vector3f> pixels) const {
  for (int depth = 1; !rays.empty(); ++depth) {
    OnwardRays onward;
    for (const LightRay& ray : rays) {
      Eigen::Vector3f& pixel = pixels[ray.pixel];
      if (ray.sight.hit.range == 0.0F) {
        pixel += ray.weight * SkyLight(ray.view);
        continue;
      }
      const float scattered = depth < kMaxDepth ? GoOnward(ray, onward) : 1.0F;
      pixel += scattered * ray.weight * Scattered(ray);
    }
    LookAlong(onward.mirrored);
    LookAlong(onward.passed);
    rays = std::move(onward.mirrored);
    rays.insert(rays.end(), onward.passed.begin(), onward.passed.end());
  }
}

Eigen::Vector3f SceneRenderer::SkyLight(const View& view) const {
  const auto sky =
      static_cast<float>(SkyAndSunLuminance(world_->lighting(), view.direction.cast<double>()));
  const float blue = view.direction.z() > 0.0F ? 0.15F : 0.0F;
  return {(1.0F - blue) * sky, sky, (1.0F + blue) * sky};
}

// What comes from the surface itself.
Eigen::Vector3f SceneRenderer::Scattered(const LightRay& ray) const {
  const Spot spot = SpotOf(*ray.moment, ray.view, ray.sight, ray.travelled + ray.sight.hit.range);
  return Illuminance(*ray.moment, ray.view, ray.sight) / kPi * Albedo(spot) +
         Eigen::Vector3f::Constant(
             static_cast<float>(ray.moment->lamp_level * spot.material->emission));
}

// Sends on what a mirror or a pane shows. Gives the share of light that it scatters itself.
float SceneRenderer::GoOnward(const LightRay& ray, OnwardRays& onward) const {
  const Material& material = MaterialOf(ray.sight.hit);
  if (material.mirror <= 0.0 && material.transmission <= 0.0) return 1.0F;
  const View& view = ray.view;
  const Eigen::Vector3f& normal = ray.sight.hit.normal;
  const float cosine = -normal.dot(view.direction);
  const auto mirrored = static_cast<float>(MirroredShare(material.mirror, cosine));
  const auto passed =
      static_cast<float>(TransmittedShare(material.transmission, material.mirror, cosine));
  const Eigen::Vector3d point =
      view.origin + static_cast<double>(ray.sight.hit.range) * view.direction.cast<double>();
  const auto add = [&](float share, const Eigen::Vector3f& direction, double side,
                       const ExposureMotion* motion, std::vector<LightRay>& rays) {
    if (share < 0.01F) return;
    rays.push_back({.moment = ray.moment,
                    .view = {.origin = point + side * kOffTheWall * normal.cast<double>(),
                             .direction = direction,
                             .pixel_angle = view.pixel_angle,
                             .motion = motion,
                             .share = view.share},
                    .pixel = ray.pixel,
                    .weight = share * ray.weight,
                    .travelled = ray.travelled + ray.sight.hit.range});
  };
  // Mirror images move in ways of their own; they stay sharp.
  add(mirrored, view.direction + 2.0F * cosine * normal, 1.0, nullptr, onward.mirrored);
  add(passed, view.direction, -1.0, view.motion, onward.passed);
  return 1.0F - mirrored - passed;
}

const TriangleMesh& SceneRenderer::MeshOf(const PacketHit& hit) const {
  if (hit.object < 0) return world_->mesh();
  return world_->movers()[static_cast<std::size_t>(hit.object)]
      .parts[static_cast<std::size_t>(hit.part)];
}

const Material& SceneRenderer::MaterialOf(const PacketHit& hit) const {
  const TriangleMesh& mesh = MeshOf(hit);
  return mesh.materials[mesh.triangle_materials[hit.triangle]];
}

std::size_t SceneRenderer::MeshIndexOf(const PacketHit& hit) const {
  if (hit.object < 0) return 0;
  return first_parts_[static_cast<std::size_t>(hit.object)] + static_cast<std::size_t>(hit.part);
}

// The way, m in axes of the world, that the surface takes through the view during the exposure,
// along the surface; zero where that is less than a third of a pixel.
Eigen::Vector3f SceneRenderer::Smear(const View& view, const Sight& sight) const {
  const Eigen::Vector3f y =
      (view.origin - view.motion->position).cast<float>() + sight.hit.range * view.direction;
  const float pixel = view.pixel_angle * y.norm();
  const ExposureMotion& motion = *view.motion;
  const bool moves = sight.hit.object >= 0;
  if (!moves && motion.turn_norm * y.norm() + motion.shift_norm < 0.3F * pixel)
    return Eigen::Vector3f::Zero();
  const Eigen::Vector3f moved = view.share * Displacement(motion, sight.hit, y);
  const Eigen::Vector3f across = moved - moved.dot(view.direction) * view.direction;
  if (across.squaredNorm() < 0.1F * pixel * pixel) return Eigen::Vector3f::Zero();
  const float cosine = std::max(0.02F, -sight.hit.normal.dot(view.direction));
  // Along the ray onto the tangent plane.
  return across + across.dot(sight.hit.normal) / cosine * view.direction;
}

SceneRenderer::Spot SceneRenderer::SpotOf(const Moment& moment, const View& view,
                                          const Sight& sight, float way) const {
  const PacketHit& hit = sight.hit;
  const TriangleMesh& mesh = MeshOf(hit);
  const std::size_t index = MeshIndexOf(hit);
  const std::uint16_t material = mesh.triangle_materials[hit.triangle];
  const auto& t = mesh.triangles[hit.triangle];
  const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                        &c = mesh.vertices[t[2]];
  Spot spot{.mesh = &mesh,
            .material = &mesh.materials[material],
            .texture = surfaces_[index][material].texture.get(),
            .triangle = hit.triangle,
            .barycentric = hit.barycentric,
            .point = a + hit.barycentric.x() * (b - a) + hit.barycentric.y() * (c - a),
            .normal = hit.normal,
            .width = way * view.pixel_angle};
  const float cosine = std::max(0.02F, -hit.normal.dot(view.direction));
  const Eigen::Vector3f along = view.direction + cosine * hit.normal;
  const float length = along.norm();
  if (length > 1e-3F) spot.stretch = (spot.width / cosine / length) * along;
  if (view.motion != nullptr) {
    const Eigen::Vector3f smear = Smear(view, sight);
    if (!smear.isZero()) AddSmear(hit.normal, smear, spot.stretch, spot.width);
  }
  if (hit.object >= 0) {
    const Eigen::Quaternionf R_part_world =
        moment.snapshot.PoseOf(hit.object, hit.part).rotation().conjugate().cast<float>();
    spot.normal = R_part_world * spot.normal;
    spot.stretch = R_part_world * spot.stretch;
  }
  spot.normal = normals_[index].At(hit.triangle, hit.barycentric, spot.normal).normalized();
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
  Eigen::Array3f weights = (spot.normal.array().abs() - 0.35F).max(0.0F).cube();
  weights /= weights.sum();
  // Soft as they are, stains need no blending of levels.
  const float patch_width =
      spot.width * static_cast<float>(patches_.size()) / kPatchTile;  // texels
  const auto patch_level = static_cast<float>(static_cast<int>(Log2(std::max(1.0F, patch_width))));
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (weights[axis] < 0.01F) continue;
    const auto [u, v] = kAxes[static_cast<std::size_t>(axis)];
    const Eigen::Vector2f uv(spot.point[u], -spot.point[v]);
    const Eigen::Vector2f stretch(spot.stretch[u], -spot.stretch[v]);
    const float stain = patches_.Sample(uv.x() / kPatchTile, uv.y() / kPatchTile, patch_level).x();
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
  const int taps = std::min(1 + static_cast<int>(0.6F * length / width), kMaxTaps);
  const float filter = std::max(width, length / static_cast<float>(taps));
  const float lod =
      BlendLess(Log2(std::max(1.0F, filter * static_cast<float>(spot.texture->size()))));
  return spot.texture->Mean(uv, stretch, taps, lod);
}

float SceneRenderer::Illuminance(const Moment& moment, const View& view, const Sight& sight) const {
  const Lighting& light = world_->lighting();
  const PacketHit& hit = sight.hit;
  const Eigen::Vector3d normal = hit.normal.cast<double>();
  const Eigen::Vector3d point =
      view.origin + static_cast<double>(hit.range) * view.direction.cast<double>();
  double lux = light.ambient_illuminance;
  if (sight.sunlit) lux += normal.dot(light.sun_direction) * light.sun_illuminance;
  if (hit.object < 0) {
    const auto soft = irradiance_->At(hit.triangle, hit.barycentric, normal);
    lux += soft.sky + moment.lamp_level * soft.lamps;
  } else {
    const double share = moment.sky_shares[static_cast<std::size_t>(hit.object)];
    lux += share * (0.6 + 0.4 * normal.z()) * light.sky_illuminance;
    for (const PointLamp& lamp : light.lamps) {
      const Eigen::Vector3d way = lamp.position - point;
      // Half of it comes round by walls and ceiling, whatever way the surface faces.
      const double cosine = 0.5 + 0.5 * std::max(0.0, normal.dot(way.normalized()));
      if (way.squaredNorm() < 100.0)
        lux += moment.lamp_level * lamp.intensity * cosine / std::max(0.25, way.squaredNorm());
    }
  }
  if (light.carried_lamp_intensity > 0.0) {
    const Eigen::Vector3d way = moment.carried_lamp - point;
    const double distance2 = std::max(0.01, way.squaredNorm());
    lux += moment.lamp_level * light.carried_lamp_intensity * std::max(0.0, normal.dot(way)) /
           (distance2 * std::sqrt(distance2));
  }
  return static_cast<float>(lux);
}

}  // namespace mlvi

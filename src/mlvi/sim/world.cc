// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/world.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/sim/embree_mesh.h"

namespace mlvi {

double MirroredShare(double mirror, double cosine) {
  const double x = 1.0 - std::min(1.0, cosine);
  return mirror + (1.0 - mirror) * x * x * x * x * x;
}

double TransmittedShare(double transmission, double mirror, double cosine) {
  if (transmission <= 0.0) return 0.0;
  return transmission * (1.0 - MirroredShare(mirror, cosine)) / (1.0 - mirror);
}

struct World::Scene {
  // A part of a moving object, with the box and the sphere around it in its own frame.
  struct Part {
    internal::EmbreeMesh mesh;
    RayBox box;
    double radius = 0.0;  // of the sphere, around the middle of the box
  };

  internal::EmbreeDevice device;
  TriangleMesh mesh;
  Lighting lighting;
  std::vector<MovingObject> movers;
  SurfaceRelief relief;
  internal::EmbreeMesh tracer;           // of `mesh`
  std::vector<std::vector<Part>> parts;  // by moving object
  Time begin = Time::FromNanoseconds(0);

  Scene(TriangleMesh the_mesh, Lighting the_lighting, std::vector<MovingObject> the_movers);
  std::vector<Part> MakeParts(const MovingObject& mover) const;
  Part MakePart(const TriangleMesh& part) const;
};

namespace {

void CheckMesh(const TriangleMesh& mesh) {
  MLVI_CHECK(!mesh.triangles.empty(), "a mesh without triangles");
  MLVI_CHECK(mesh.triangles.size() == mesh.triangle_materials.size(),
             "{} triangles, {} materials of triangles", mesh.triangles.size(),
             mesh.triangle_materials.size());
  MLVI_CHECK(
      mesh.texture_coordinates.empty() || mesh.texture_coordinates.size() == mesh.vertices.size(),
      "{} vertices, {} texture coordinates", mesh.vertices.size(), mesh.texture_coordinates.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t v : mesh.triangles[i]) {
      MLVI_CHECK(v < mesh.vertices.size(), "triangle {}: vertex {} of {}", i, v,
                 mesh.vertices.size());
    }
    MLVI_CHECK(mesh.triangle_materials[i] < mesh.materials.size(), "triangle {}: material {} of {}",
               i, mesh.triangle_materials[i], mesh.materials.size());
  }
}

// What a ray of the frame of `mesh` met, in that frame.
SurfaceHit HitOf(const TriangleMesh& mesh, const internal::MeshHit& hit,
                 const Eigen::Vector3d& direction) {
  Eigen::Vector3d normal = hit.normal.cast<double>().normalized();
  if (normal.dot(direction) > 0.0) normal = -normal;
  return {.range = hit.range,
          .normal = normal,
          .material = &mesh.materials[mesh.triangle_materials[hit.triangle]],
          .triangle = hit.triangle,
          .barycentric = {hit.u, hit.v}};
}

}  // namespace

World::Scene::Scene(TriangleMesh the_mesh, Lighting the_lighting,
                    std::vector<MovingObject> the_movers)
    : mesh((CheckMesh(the_mesh), std::move(the_mesh))),
      lighting(std::move(the_lighting)),
      movers(std::move(the_movers)),
      tracer(device, mesh) {
  for (const MovingObject& mover : movers) parts.push_back(MakeParts(mover));
}

std::vector<World::Scene::Part> World::Scene::MakeParts(const MovingObject& mover) const {
  MLVI_CHECK(!mover.parts.empty() && mover.poses, "moving object '{}' has no parts or no poses",
             mover.name);
  std::vector<Part> its_parts;
  for (const TriangleMesh& part : mover.parts) its_parts.push_back(MakePart(part));
  return its_parts;
}

World::Scene::Part World::Scene::MakePart(const TriangleMesh& part) const {
  CheckMesh(part);
  Eigen::Vector3f low = part.vertices.front(), high = low;
  for (const Eigen::Vector3f& vertex : part.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  constexpr double kRoom = 0.001;  // m, since rays are known to single precision
  Part result{.mesh = internal::EmbreeMesh(device, part),
              .box = {.centre = 0.5 * (low + high).cast<double>(),
                      .half = (0.5 * (high - low).cast<double>()).array() + kRoom}};
  for (const Eigen::Vector3f& vertex : part.vertices)
    result.radius = std::max(result.radius, (vertex.cast<double>() - result.box.centre).norm());
  return result;
}

World::World(TriangleMesh mesh, Lighting lighting, std::vector<MovingObject> movers)
    : scene_(std::make_unique<Scene>(std::move(mesh), std::move(lighting), std::move(movers))) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const TriangleMesh& World::mesh() const { return scene_->mesh; }
const Lighting& World::lighting() const { return scene_->lighting; }
const std::vector<MovingObject>& World::movers() const { return scene_->movers; }

const SurfaceRelief& World::relief() const { return scene_->relief; }

const Material& World::MaterialOf(const PacketHit& hit) const {
  const TriangleMesh& mesh = hit.object < 0 ? scene_->mesh
                                            : scene_->movers[static_cast<std::size_t>(hit.object)]
                                                  .parts[static_cast<std::size_t>(hit.part)];
  return mesh.materials[mesh.triangle_materials[hit.triangle]];
}

void World::StartClock(Time begin) { scene_->begin = begin; }
void World::AddMover(MovingObject mover) {
  scene_->parts.push_back(scene_->MakeParts(mover));
  scene_->movers.push_back(std::move(mover));
}
void World::SetLampLevel(std::function<double(double seconds)> level) {
  scene_->lighting.lamp_level = std::move(level);
}

double World::SecondsOf(Time time) const { return (time - scene_->begin).seconds(); }
WorldSnapshot World::At(Time time) const { return WorldSnapshot(*this, SecondsOf(time)); }
WorldSnapshot World::StaticSnapshot() const { return WorldSnapshot(*this); }

std::optional<SurfaceHit> World::Cast(const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double max_range) const {
  const auto hit = scene_->tracer.Cast(origin, direction, max_range);
  if (!hit) return std::nullopt;
  return HitOf(scene_->mesh, *hit, direction);
}

double World::Clearance(const Eigen::Vector3d& point, double max_range) const {
  constexpr int kDirections = 200;
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  double clearance = max_range;
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
    const double radius = std::sqrt(1.0 - z * z), angle = golden_angle * i;
    const auto hit =
        Cast(point, {radius * std::cos(angle), radius * std::sin(angle), z}, clearance);
    if (hit) clearance = hit->range;
  }
  return clearance;
}

WorldSnapshot::WorldSnapshot(const World& world, double seconds)
    : world_(&world), seconds_(seconds) {
  const World::Scene& scene = *world.scene_;
  for (std::size_t i = 0; i < scene.movers.size(); ++i) {
    const auto& parts = scene.parts[i];
    const std::size_t first = poses_.size();
    firsts_.push_back(first);
    poses_.resize(first + parts.size());
    scene.movers[i].poses(seconds, std::span(poses_).subspan(first));
    Sphere bound;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      inverses_.push_back(poses_[first + k].inverse());
      centres_.push_back(poses_[first + k] * parts[k].box.centre);
      bound.centre += centres_.back() / static_cast<double>(parts.size());
    }
    for (std::size_t k = 0; k < parts.size(); ++k) {
      bound.radius =
          std::max(bound.radius, (centres_[first + k] - bound.centre).norm() + parts[k].radius);
    }
    bounds_.push_back(bound);
  }
}

const Pose3& WorldSnapshot::PoseOf(int object, int part) const {
  return poses_.at(firsts_.at(static_cast<std::size_t>(object)) + static_cast<std::size_t>(part));
}

std::vector<WorldSnapshot::Obstacle> WorldSnapshot::MovingParts(const Eigen::Vector3d& point,
                                                                double slack) const {
  std::vector<Obstacle> obstacles;
  for (std::size_t object = 0; object < firsts_.size(); ++object) {
    const auto& parts = world_->scene_->parts[object];
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const std::size_t index = firsts_[object] + k;
      const Eigen::Vector3d to_centre = centres_[index] - point;
      const double distance = to_centre.norm();
      const RayBox& box = parts[k].box;
      const double room = 0.01 * (distance + parts[k].radius + slack);  // at its farther side
      Obstacle& obstacle =
          obstacles.emplace_back(Obstacle{.R_part_world = inverses_[index].R(),
                                          .p_part_world = inverses_[index].translation(),
                                          .box = {box.centre, box.half.array() + room}});
      // A ray from `slack` beside the point is one from the point to the box moved by as much.
      const Eigen::Vector3d half = obstacle.box.half.array() + slack;
      const Eigen::Vector3d axis = to_centre / std::max(distance, 1e-9);
      double cosine = 1.0;
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d signs((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5,
                                    (corner >> 2) - 0.5);
        const Eigen::Vector3d way =
            to_centre + obstacle.R_part_world.transpose() * (2.0 * signs.cwiseProduct(half));
        cosine = std::min(cosine, way.dot(axis) / way.norm());
      }
      if (cosine <= 0.0) continue;  // not convex: all directions
      obstacle.axis = axis;
      obstacle.cosine = cosine;
    }
  }
  return obstacles;
}

namespace {

// Whether the ray may meet the sphere before `max_range`.
bool MayMeet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range,
             const Eigen::Vector3d& centre, double radius) {
  const Eigen::Vector3d to_centre = centre - origin;
  const double along = to_centre.dot(direction);
  if (along < -radius || along > max_range + radius) return false;
  return to_centre.squaredNorm() - along * along <= radius * radius;
}

}  // namespace

// A ray in the frame of a part of a moving object that it may meet.
struct WorldSnapshot::PartRay {
  std::size_t object = 0, part = 0;
  std::size_t index = 0;  // of the part among all
  Eigen::Vector3d origin, direction;
};

std::optional<WorldSnapshot::PartRay> WorldSnapshot::ToPart(std::size_t object, std::size_t part,
                                                            const Eigen::Vector3d& origin,
                                                            const Eigen::Vector3d& direction,
                                                            double max_range) const {
  const std::size_t index = firsts_[object] + part;
  const World::Scene::Part& bound = world_->scene_->parts[object][part];
  if (!MayMeet(origin, direction, max_range, centres_[index], bound.radius)) return std::nullopt;
  const Pose3& T_part_world = inverses_[index];
  PartRay ray{.object = object,
              .part = part,
              .index = index,
              .origin = T_part_world * origin,
              .direction = T_part_world.rotation() * direction};
  if (!bound.box.MayBeMet(ray.origin, ray.direction)) return std::nullopt;
  return ray;
}

// Calls visit(PartRay) for the parts that the ray may meet.
template <typename Visit>
void WorldSnapshot::VisitMovers(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                double max_range, const Visit& visit) const {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    if (!MayMeet(origin, direction, max_range, bounds_[i].centre, bounds_[i].radius)) continue;
    for (std::size_t k = 0; k < world_->scene_->parts[i].size(); ++k) {
      if (const auto ray = ToPart(i, k, origin, direction, max_range)) visit(*ray);
    }
  }
}

std::optional<SurfaceHit> WorldSnapshot::Cast(const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction,
                                              double max_range) const {
  auto nearest = world_->Cast(origin, direction, max_range);
  if (bounds_.empty()) return nearest;
  const World::Scene& scene = *world_->scene_;
  const double limit = nearest ? nearest->range : max_range;
  VisitMovers(origin, direction, limit, [&](const PartRay& ray) {
    const auto hit = scene.parts[ray.object][ray.part].mesh.Cast(
        ray.origin, ray.direction, nearest ? nearest->range : max_range);
    if (!hit) return;
    nearest = HitOf(scene.movers[ray.object].parts[ray.part], *hit, ray.direction);
    nearest->normal = poses_[ray.index].rotation() * nearest->normal;
    nearest->object = static_cast<int>(ray.object);
    nearest->part = static_cast<int>(ray.part);
  });
  return nearest;
}

bool WorldSnapshot::Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                             double max_range) const {
  const World::Scene& scene = *world_->scene_;
  bool occluded = scene.tracer.Occluded(origin, direction, max_range);
  VisitMovers(origin, direction, max_range, [&](const PartRay& ray) {
    occluded = occluded || scene.parts[ray.object][ray.part].mesh.Occluded(
                               ray.origin, ray.direction, max_range);
  });
  return occluded;
}

namespace {

// A cone around the active rays of a packet: it starts in a ball around their origins.
class PacketCone {
 public:
  template <std::size_t N>
  PacketCone(const RayPacketOf<N>& rays, unsigned active) {
    // Lanes side by side, those of inactive rays like the first active one.
    const auto first = static_cast<std::size_t>(std::countr_zero(active));
    const auto filled = [&](const typename RayPacketOf<N>::Lanes& lanes) {
      Quads<N> all;
      std::memcpy(all.data(), lanes.data(), sizeof(lanes));
      for (std::size_t i = 0; std::popcount(active) < rays.kSize && i < N; ++i) {
        if ((active >> i & 1U) == 0) all[i / 4][i % 4] = lanes[first];
      }
      return all;
    };
    const Quads<N> x = filled(rays.x), y = filled(rays.y), z = filled(rays.z);
    const Quads<N> dx = filled(rays.dx), dy = filled(rays.dy), dz = filled(rays.dz);
    origin_ = {rays.x[first], rays.y[first], rays.z[first]};
    axis_ = Eigen::Vector3f(SumOf<N>(dx), SumOf<N>(dy), SumOf<N>(dz)).normalized();
    Quad cosine = {1.0F, 1.0F, 1.0F, 1.0F}, away2 = {};
    for (std::size_t i = 0; i < N / 4; ++i) {
      const Quad c = axis_.x() * dx[i] + axis_.y() * dy[i] + axis_.z() * dz[i];
      const Quad px = x[i] - origin_.x(), py = y[i] - origin_.y(), pz = z[i] - origin_.z();
      const Quad p2 = px * px + py * py + pz * pz;
      cosine = c < cosine ? c : cosine;
      away2 = p2 > away2 ? p2 : away2;
    }
    // All of this is known to single precision.
    cosine_ = std::min({cosine[0], cosine[1], cosine[2], cosine[3]}) - 1e-6F;
    sine_ = std::sqrt(std::max(0.0F, 1.0F - cosine_ * cosine_));
    spread_ = std::sqrt(std::max({away2[0], away2[1], away2[2], away2[3]})) + 0.01F;
  }

  bool MayMeet(const Eigen::Vector3f& centre, float radius) const {
    if (!(cosine_ > 0.0F)) return true;  // more than half of all directions
    const Eigen::Vector3f to_centre = centre - origin_;
    const float reach = radius + spread_, along = to_centre.dot(axis_);
    const float across = std::sqrt(std::max(0.0F, to_centre.squaredNorm() - along * along));
    return along * sine_ + reach >= across * cosine_ && along + reach >= 0.0F;
  }

 private:
  using Quad = float __attribute__((vector_size(16)));
  template <std::size_t N>
  using Quads = std::array<Quad, N / 4>;
  template <std::size_t N>
  static float SumOf(const Quads<N>& quads) {
    Quad sum = {};
    for (const Quad& quad : quads) sum += quad;
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }

  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero(), axis_ = Eigen::Vector3f::Zero();
  float cosine_ = 1.0F, sine_ = 0.0F, spread_ = 0.0F;
};

}  // namespace

// A ball around what is in sphere_at(snapshot) for all active snapshots.
template <std::size_t N, typename SphereAt>
WorldSnapshot::Sphere WorldSnapshot::BoundOf(const PerRayOf<N>& snapshots, unsigned active,
                                             const SphereAt& sphere_at) {
  const auto at = [&](unsigned lanes) -> const WorldSnapshot& {
    return *snapshots[static_cast<std::size_t>(std::countr_zero(lanes))];
  };
  Sphere bound = sphere_at(at(active));
  double away2 = 0.0;
  for (unsigned left = active & (active - 1); left != 0; left &= left - 1) {
    const Sphere other = sphere_at(at(left));
    away2 = std::max(away2, (other.centre - bound.centre).squaredNorm());
    bound.radius = std::max(bound.radius, other.radius);
  }
  bound.radius += std::sqrt(away2);
  return bound;
}

// Calls visit(number of the ray, PartRay) for all pairs of a ray and a part that may meet.
template <std::size_t N, typename Visit>
void WorldSnapshot::VisitMovers(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots,
                                const Visit& visit) {
  unsigned active = 0;  // rays of snapshots with moving objects
  for (int ray = 0; ray < rays.kSize; ++ray) {
    if (rays.IsActive(ray) && !snapshots[static_cast<std::size_t>(ray)]->bounds_.empty())
      active |= 1U << ray;
  }
  if (active == 0) return;
  // Their snapshots, each once: mostly one or a few.
  PerRayOf<N> instants;
  std::size_t count = 0;
  for (unsigned left = active; left != 0; left &= left - 1) {
    const WorldSnapshot* at = snapshots[static_cast<std::size_t>(std::countr_zero(left))];
    const auto known = std::span(instants).first(count);
    if (std::ranges::find(known, at) == known.end()) instants[count++] = at;
  }
  const WorldSnapshot& first = *instants.front();
  const PacketCone cone(rays, active);
  const auto may_meet = [&](const auto& sphere_at) {
    const Sphere bound = BoundOf(instants, (1U << count) - 1, sphere_at);
    return cone.MayMeet(bound.centre.template cast<float>(), static_cast<float>(bound.radius));
  };
  for (std::size_t object = 0; object < first.bounds_.size(); ++object) {
    if (!may_meet([&](const WorldSnapshot& at) { return at.bounds_[object]; })) continue;
    const auto& parts = first.world_->scene_->parts[object];
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const std::size_t index = first.firsts_[object] + k;
      if (!may_meet([&](const WorldSnapshot& at) {
            return Sphere{at.centres_[index], parts[k].radius};
          }))
        continue;
      for (unsigned left = active; left != 0; left &= left - 1) {
        const int ray = std::countr_zero(left);
        const auto lane = static_cast<std::size_t>(ray);
        const auto at =
            snapshots[lane]->ToPart(object, k, rays.Origin(ray).template cast<double>(),
                                    rays.Direction(ray).template cast<double>(), rays.limit[lane]);
        if (at) visit(ray, *at);
      }
    }
  }
}

template <std::size_t N>
PacketHitsOf<N> WorldSnapshot::Cast(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots) {
  PacketHitsOf<N> hits;
  const World::Scene& scene = *snapshots.front()->world_->scene_;
  scene.tracer.Cast(rays, hits);
  VisitMovers(rays, snapshots, [&](int ray, const PartRay& at) {
    const auto lane = static_cast<std::size_t>(ray);
    PacketHit& nearest = hits[lane];
    const auto hit = scene.parts[at.object][at.part].mesh.Cast(
        at.origin, at.direction, nearest.range > 0.0F ? nearest.range : rays.limit[lane]);
    if (!hit) return;
    const SurfaceHit surface = HitOf(scene.movers[at.object].parts[at.part], *hit, at.direction);
    const Pose3& T_world_part = snapshots[lane]->poses_[at.index];
    nearest = {.range = hit->range,
               .normal = (T_world_part.rotation() * surface.normal).cast<float>(),
               .triangle = hit->triangle,
               .barycentric = {hit->u, hit->v},
               .object = static_cast<std::int16_t>(at.object),
               .part = static_cast<std::int16_t>(at.part)};
  });
  return hits;
}

template <std::size_t N>
unsigned WorldSnapshot::Occluded(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots) {
  const World::Scene& scene = *snapshots.front()->world_->scene_;
  unsigned occluded = scene.tracer.Occluded(rays);
  VisitMovers(rays, snapshots, [&](int ray, const PartRay& at) {
    const unsigned bit = 1U << ray;
    const double limit = rays.limit[static_cast<std::size_t>(ray)];
    if ((occluded & bit) == 0 &&
        scene.parts[at.object][at.part].mesh.Occluded(at.origin, at.direction, limit))
      occluded |= bit;
  });
  return occluded;
}

template PacketHitsOf<8> WorldSnapshot::Cast(const RayPacketOf<8>&, const PerRayOf<8>&);
template PacketHitsOf<16> WorldSnapshot::Cast(const RayPacketOf<16>&, const PerRayOf<16>&);
template unsigned WorldSnapshot::Occluded(const RayPacketOf<8>&, const PerRayOf<8>&);
template unsigned WorldSnapshot::Occluded(const RayPacketOf<16>&, const PerRayOf<16>&);

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/world.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
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
  // A part of a moving object, with the sphere around it in its own frame.
  struct Part {
    internal::EmbreeMesh mesh;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 0.0;
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
  Part result{.mesh = internal::EmbreeMesh(device, part),
              .centre = 0.5 * (low + high).cast<double>()};
  for (const Eigen::Vector3f& vertex : part.vertices)
    result.radius = std::max(result.radius, (vertex.cast<double>() - result.centre).norm());
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
      centres_.push_back(poses_[first + k] * parts[k].centre);
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

std::vector<WorldSnapshot::Cone> WorldSnapshot::MovingParts(const Eigen::Vector3d& point,
                                                            double slack) const {
  std::vector<Cone> cones;
  for (std::size_t object = 0; object < firsts_.size(); ++object) {
    const auto& parts = world_->scene_->parts[object];
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Eigen::Vector3d to_centre = centres_[firsts_[object] + k] - point;
      const double distance = to_centre.norm(), radius = parts[k].radius + slack + 0.01 * distance;
      if (distance <= radius) return {Cone{}};
      const double sine = radius / distance;
      cones.push_back({to_centre / distance, std::sqrt(1.0 - sine * sine)});
    }
  }
  return cones;
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

// Calls visit(object, part, index of the part among all) for the parts that the ray may meet.
template <typename Visit>
void WorldSnapshot::VisitMovers(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                double max_range, const Visit& visit) const {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    if (!MayMeet(origin, direction, max_range, bounds_[i].centre, bounds_[i].radius)) continue;
    const auto& parts = world_->scene_->parts[i];
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const std::size_t index = firsts_[i] + k;
      if (MayMeet(origin, direction, max_range, centres_[index], parts[k].radius))
        visit(i, k, index);
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
  VisitMovers(origin, direction, limit, [&](std::size_t i, std::size_t k, std::size_t index) {
    const Pose3& T_part_world = inverses_[index];
    const Eigen::Vector3d local_direction = T_part_world.rotation() * direction;
    const auto hit = scene.parts[i][k].mesh.Cast(T_part_world * origin, local_direction,
                                                 nearest ? nearest->range : max_range);
    if (!hit) return;
    nearest = HitOf(scene.movers[i].parts[k], *hit, local_direction);
    nearest->normal = poses_[index].rotation() * nearest->normal;
    nearest->object = static_cast<int>(i);
    nearest->part = static_cast<int>(k);
  });
  return nearest;
}

bool WorldSnapshot::Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                             double max_range) const {
  const World::Scene& scene = *world_->scene_;
  bool occluded = scene.tracer.Occluded(origin, direction, max_range);
  VisitMovers(origin, direction, max_range, [&](std::size_t i, std::size_t k, std::size_t index) {
    if (occluded) return;
    occluded = scene.parts[i][k].mesh.Occluded(inverses_[index] * origin,
                                               inverses_[index].rotation() * direction, max_range);
  });
  return occluded;
}

namespace {

// A cone around all rays of a packet: it starts in a ball around their origins.
class PacketCone {
 public:
  template <std::size_t N>
  explicit PacketCone(const RayPacketOf<N>& rays) {
    // Lanes side by side, those of inactive rays like the first active one.
    const auto first = static_cast<std::size_t>(std::countr_zero(rays.active));
    const auto filled = [&](const typename RayPacketOf<N>::Lanes& lanes) {
      auto all = lanes;
      for (std::size_t i = 0; i < N; ++i) {
        if ((rays.active >> i & 1U) == 0) all[i] = lanes[first];
      }
      return all;
    };
    const auto x = filled(rays.x), y = filled(rays.y), z = filled(rays.z);
    const auto dx = filled(rays.dx), dy = filled(rays.dy), dz = filled(rays.dz);
    origin_ = {x[first], y[first], z[first]};
    for (std::size_t i = 0; i < N; ++i) axis_ += Eigen::Vector3f(dx[i], dy[i], dz[i]);
    axis_.normalize();
    float away2 = 0.0F;
    for (std::size_t i = 0; i < N; ++i) {
      cosine_ = std::min(cosine_, axis_.x() * dx[i] + axis_.y() * dy[i] + axis_.z() * dz[i]);
      const float px = x[i] - origin_.x(), py = y[i] - origin_.y(), pz = z[i] - origin_.z();
      away2 = std::max(away2, px * px + py * py + pz * pz);
    }
    spread_ = std::sqrt(away2) + 0.01F;  // all of this is known to single precision
    cosine_ -= 1e-6F;
    sine_ = std::sqrt(std::max(0.0F, 1.0F - cosine_ * cosine_));
  }

  bool MayMeet(const Eigen::Vector3f& centre, float radius) const {
    if (!(cosine_ > 0.0F)) return true;  // more than half of all directions
    const Eigen::Vector3f to_centre = centre - origin_;
    const float reach = radius + spread_, along = to_centre.dot(axis_);
    const float across = std::sqrt(std::max(0.0F, to_centre.squaredNorm() - along * along));
    return along * sine_ + reach >= across * cosine_ && along + reach >= 0.0F;
  }

 private:
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero(), axis_ = Eigen::Vector3f::Zero();
  float cosine_ = 1.0F, sine_ = 0.0F, spread_ = 0.0F;
};

}  // namespace

// A ray of a packet in the frame of a part of a moving object that it may meet.
struct WorldSnapshot::PartRay {
  int ray = 0;
  std::size_t object = 0, part = 0;
  const WorldSnapshot* snapshot = nullptr;
  Eigen::Vector3d origin, direction;
};

// A ball around where an object is at the instants of all rays.
template <std::size_t N>
WorldSnapshot::Sphere WorldSnapshot::BoundOf(std::size_t object, const RayPacketOf<N>& rays,
                                             const PerRayOf<N>& snapshots) {
  const WorldSnapshot* known = snapshots[static_cast<std::size_t>(std::countr_zero(rays.active))];
  Sphere bound = known->bounds_[object];
  double away2 = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    if (!rays.IsActive(static_cast<int>(i)) || snapshots[i] == known) continue;
    known = snapshots[i];
    const Sphere& other = known->bounds_[object];
    away2 = std::max(away2, (other.centre - bound.centre).squaredNorm());
    bound.radius = std::max(bound.radius, other.radius);
  }
  bound.radius += std::sqrt(away2);
  return bound;
}

// Calls visit(PartRay) for all pairs of a ray and a part of a moving object that may meet.
template <std::size_t N, typename Visit>
void WorldSnapshot::VisitMovers(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots,
                                const Visit& visit) {
  const WorldSnapshot& first = *snapshots.front();
  if (first.bounds_.empty() || rays.active == 0) return;
  const PacketCone cone(rays);
  for (std::size_t object = 0; object < first.bounds_.size(); ++object) {
    const Sphere bound = BoundOf(object, rays, snapshots);
    if (!cone.MayMeet(bound.centre.cast<float>(), static_cast<float>(bound.radius))) continue;
    const auto& parts = first.world_->scene_->parts[object];
    for (int ray = 0; ray < rays.kSize; ++ray) {
      if (!rays.IsActive(ray)) continue;
      const WorldSnapshot& snapshot = *snapshots[static_cast<std::size_t>(ray)];
      const Eigen::Vector3d origin = rays.Origin(ray).template cast<double>(),
                            direction = rays.Direction(ray).template cast<double>();
      const double limit = rays.limit[static_cast<std::size_t>(ray)];
      for (std::size_t k = 0; k < parts.size(); ++k) {
        const std::size_t index = snapshot.firsts_[object] + k;
        if (!mlvi::MayMeet(origin, direction, limit, snapshot.centres_[index], parts[k].radius))
          continue;
        const Pose3& T_part_world = snapshot.inverses_[index];
        visit(PartRay{ray, object, k, &snapshot, T_part_world * origin,
                      T_part_world.rotation() * direction});
      }
    }
  }
}

template <std::size_t N>
PacketHitsOf<N> WorldSnapshot::Cast(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots) {
  PacketHitsOf<N> hits;
  const World::Scene& scene = *snapshots.front()->world_->scene_;
  scene.tracer.Cast(rays, hits);
  VisitMovers(rays, snapshots, [&](const PartRay& at) {
    const auto lane = static_cast<std::size_t>(at.ray);
    PacketHit& nearest = hits[lane];
    const auto hit = scene.parts[at.object][at.part].mesh.Cast(
        at.origin, at.direction, nearest.range > 0.0F ? nearest.range : rays.limit[lane]);
    if (!hit) return;
    const SurfaceHit surface = HitOf(scene.movers[at.object].parts[at.part], *hit, at.direction);
    const Pose3& T_world_part = at.snapshot->poses_[at.snapshot->firsts_[at.object] + at.part];
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
  VisitMovers(rays, snapshots, [&](const PartRay& at) {
    const unsigned bit = 1U << at.ray;
    const double limit = rays.limit[static_cast<std::size_t>(at.ray)];
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

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/sim/embree_mesh.h"

namespace mlvi {

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
  internal::EmbreeMesh tracer;           // of `mesh`
  std::vector<std::vector<Part>> parts;  // by moving object
  Time begin = Time::FromNanoseconds(0);

  Scene(TriangleMesh the_mesh, Lighting the_lighting, std::vector<MovingObject> the_movers);
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
  for (const MovingObject& mover : movers) {
    MLVI_CHECK(!mover.parts.empty() && mover.poses, "moving object '{}' has no parts or no poses",
               mover.name);
    auto& its_parts = parts.emplace_back();
    for (const TriangleMesh& part : mover.parts) its_parts.push_back(MakePart(part));
  }
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

void World::StartClock(Time begin) { scene_->begin = begin; }
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

}  // namespace mlvi

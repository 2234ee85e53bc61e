// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mlvi/base/time.h"
#include "mlvi/geometry/pose3.h"
#include "mlvi/sim/lighting.h"
#include "mlvi/sim/ray_box.h"
#include "mlvi/sim/ray_packet.h"
#include "mlvi/sim/surface_relief.h"
#include "mlvi/sim/texture.h"

namespace mlvi {

// How a texture lies on a surface.
enum class TextureMapping : int {
  // By position and normal in the frame of the mesh: projected along the nearest axes, blended
  // between them, so without seams. Rows of a texture lie level on walls of any heading.
  kTriplanar = 0,
  kVertex = 1,  // by TriangleMesh::texture_coordinates
};

// What a surface is made of.
struct Material {
  std::string name;
  double reflectivity = 0.5;  // of the LiDAR's wavelength at normal incidence, in [0, 1]
  // Visible light, for cameras. `image` (of an own scene) takes the place of `texture`.
  TextureRecipe texture = {};
  std::shared_ptr<const Texture> image = {};
  double tile = 4.0;  // m, side of one repeat of the texture
  TextureMapping mapping = TextureMapping::kTriplanar;
  double emission = 0.0;  // cd/m^2, of lamp shades at full Lighting::lamp_level; lights nothing
  // Glass and gloss: shares of light that pass straight through and that are mirrored at normal
  // incidence; the rest is scattered like by any other surface. Mirroring grows towards grazing
  // incidence (Schlick). Sum <= 1. `transmission` holds for the LiDAR's light, too.
  double transmission = 0.0;
  double mirror = 0.0;
  // What the LiDAR's light is mirrored by in the same way: panes, mirrors and water only. The gloss
  // of a floor or of paint, which images show, is too rough to send a pulse on in one piece.
  double lidar_mirror = 0.0;
  // Signs, number plates, safety vests: returns the LiDAR's light to where it came from.
  bool retroreflective = false;
  // How far from plane it is, for LiDARs, where it stands still. Of smooth surfaces (`transmission`
  // or `lidar_mirror` positive) none.
  Relief relief = {};
};

// Shares of light that a smooth surface mirrors (Schlick 1994) and passes at the cosine of an angle
// of incidence, from those at normal incidence.
double MirroredShare(double mirror, double cosine);
double TransmittedShare(double transmission, double mirror, double cosine);

// Triangles in the frame of the mesh (the world's: z up, m), seen from both sides.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> triangle_materials;  // index into materials, one per triangle
  std::vector<Material> materials;
  // One per vertex, or none at all: u to the right, v down, in the unit of Material::tile (so in
  // repeats of the texture where tile is 1). For materials with TextureMapping::kVertex.
  std::vector<Eigen::Vector2f> texture_coordinates = {};
};

// Something that moves: rigid parts (of a person: trunk, head, arms, legs), each on its own way.
struct MovingObject {
  std::string name;
  std::vector<TriangleMesh> parts;  // each in its own frame
  // Writes T_world_part of all parts at a time (s after the beginning of the recording). Same time,
  // same poses; called from many threads. The way should be smooth: cameras see it within an
  // exposure, LiDARs at every firing.
  std::function<void(double seconds, std::span<Pose3> T_world_part)> poses;
};

struct SurfaceHit {
  double range = 0.0;                                // m along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, on the side that the ray comes from
  const Material* material = nullptr;                // owned by the world
  int object = -1;                                   // index of the moving object; -1: static
  int part = 0;                                      // of the moving object
  std::uint32_t triangle = 0;                        // of the mesh of world or part
  Eigen::Vector2f barycentric = Eigen::Vector2f::Zero();  // weights of its second and third vertex
};

class WorldSnapshot;

// A scene for ray tracing: static triangles, moving objects, light. Const functions are thread-safe
// and give the same bits on every call.
class World {
 public:
  explicit World(TriangleMesh mesh, Lighting lighting = {}, std::vector<MovingObject> movers = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const TriangleMesh& mesh() const;
  const Lighting& lighting() const;
  const std::vector<MovingObject>& movers() const;
  // How Material::relief lies on the static surfaces.
  const SurfaceRelief& relief() const;

  // The instant that moving objects and lamps count their seconds from; the epoch of the clock
  // unless set.
  void StartClock(Time begin);
  // One more. Not to be called while others use the world.
  void AddMover(MovingObject mover);
  // Of what a ray of a packet met.
  const Material& MaterialOf(const PacketHit& hit) const;
  double SecondsOf(Time time) const;
  // What the lamps give from now on (Lighting::lamp_level).
  void SetLampLevel(std::function<double(double seconds)> level);

  // The world at an instant. Cheap (poses of the moving objects); refers to this world.
  WorldSnapshot At(Time time) const;
  // The world without its moving objects.
  WorldSnapshot StaticSnapshot() const;

  // The first static surface from `origin` along the unit vector `direction`, not farther than
  // `max_range`. Moving objects are met through At(time).
  std::optional<SurfaceHit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double max_range) const;
  // Distance to the nearest static surface as seen by rays in all directions (200 of them, evenly
  // spread), or `max_range` when none comes closer. Thin objects between two rays can be missed.
  double Clearance(const Eigen::Vector3d& point, double max_range) const;

 private:
  friend class WorldSnapshot;
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

// The world at one instant: moving objects stand where they are then.
class WorldSnapshot {
 public:
  const World& world() const { return *world_; }
  double seconds() const { return seconds_; }
  // T_world_part of a part of a moving object.
  const Pose3& PoseOf(int object, int part) const;

  // What a moving part takes up of the view from within `slack` m of a point, with room for beams
  // of 0.01 rad to each side: a ray from there that misses its cone, or the box in its own frame,
  // meets nothing of it.
  struct Obstacle {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
    double cosine = -1.0;  // of half the cone's opening; -1: all directions
    Eigen::Matrix3d R_part_world = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p_part_world = Eigen::Vector3d::Zero();
    RayBox box;

    bool MayBeMet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
      return axis.dot(direction) >= cosine &&
             box.MayBeMet(R_part_world * origin + p_part_world, R_part_world * direction);
    }
  };
  // One for every moving part.
  std::vector<Obstacle> MovingParts(const Eigen::Vector3d& point, double slack) const;

  // The first surface, static or moving.
  std::optional<SurfaceHit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double max_range) const;
  // Whether anything that lets no light through (Material::transmission 0) lies between `origin`
  // and `max_range` along the unit vector `direction`.
  bool Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                double max_range) const;

  // Packets of 8 or 16 rays, each at its own instant: `snapshots` are of one world (some may be
  // without its moving objects), one for each ray (that of a ray that is not active may be any). Cast gives the first surface of every active
  // ray, Occluded the bits of those as Occluded of one ray does.
  template <std::size_t N>
  using PerRayOf = std::array<const WorldSnapshot*, N>;
  using PerRay = PerRayOf<8>;
  template <std::size_t N>
  static PacketHitsOf<N> Cast(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots);
  template <std::size_t N>
  static unsigned Occluded(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots);

 private:
  friend class World;
  struct Sphere {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, world
    double radius = 0.0;
  };
  explicit WorldSnapshot(const World& world) : world_(&world) {}
  WorldSnapshot(const World& world, double seconds);
  struct PartRay;
  template <typename Visit>
  void VisitMovers(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   double max_range, const Visit& visit) const;
  std::optional<PartRay> ToPart(std::size_t object, std::size_t part, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction, double max_range) const;
  template <std::size_t N, typename SphereAt>
  static Sphere BoundOf(const PerRayOf<N>& snapshots, unsigned active, const SphereAt& sphere_at);
  template <std::size_t N, typename Visit>
  static void VisitMovers(const RayPacketOf<N>& rays, const PerRayOf<N>& snapshots,
                          const Visit& visit);

  const World* world_;
  double seconds_ = 0.0;  // after the start of the world's clock
  // Of all parts, object by object; `firsts_` has the index of each object's first part.
  std::vector<std::size_t> firsts_;
  std::vector<Pose3> poses_;              // T_world_part
  std::vector<Pose3> inverses_;           // T_part_world
  std::vector<Eigen::Vector3d> centres_;  // of the spheres around the parts, world
  std::vector<Sphere> bounds_;            // of each object
};

}  // namespace mlvi

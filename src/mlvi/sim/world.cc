// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/world.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "mlvi/base/error.h"
#include "mlvi/sim/embree.h"

namespace mlvi {

struct World::Scene {
  TriangleMesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  explicit Scene(TriangleMesh the_mesh);
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
};

namespace {

void CheckMesh(const TriangleMesh& mesh) {
  MLVI_CHECK(!mesh.triangles.empty(), "a world without triangles");
  MLVI_CHECK(mesh.triangles.size() == mesh.triangle_materials.size(),
             "{} triangles, {} materials of triangles", mesh.triangles.size(),
             mesh.triangle_materials.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t v : mesh.triangles[i]) {
      MLVI_CHECK(v < mesh.vertices.size(), "triangle {}: vertex {} of {}", i, v,
                 mesh.vertices.size());
    }
    MLVI_CHECK(mesh.triangle_materials[i] < mesh.materials.size(), "triangle {}: material {} of {}",
               i, mesh.triangle_materials[i], mesh.materials.size());
  }
}

template <typename Element>
void CopyToBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                  const std::vector<Element>& elements) {
  static_assert(sizeof(Element) == 12, "three packed 32-bit numbers");
  auto* buffer = static_cast<Element*>(
      rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Element), elements.size()));
  MLVI_CHECK(buffer != nullptr, "no memory for {} elements", elements.size());
  std::copy(elements.begin(), elements.end(), buffer);
}

}  // namespace

// One build thread: the tree, and with it the choice between triangles hit at equal range, is the
// same on every run.
World::Scene::Scene(TriangleMesh the_mesh)
    : mesh(std::move(the_mesh)), device(rtcNewDevice("threads=1")) {
  CheckMesh(mesh);
  MLVI_CHECK(device != nullptr, "Embree has no device: error {}",
             static_cast<int>(rtcGetDeviceError(nullptr)));
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // watertight edges
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  CopyToBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.vertices);
  CopyToBuffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
}

World::World(TriangleMesh mesh) : scene_(std::make_unique<Scene>(std::move(mesh))) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const TriangleMesh& World::mesh() const { return scene_->mesh; }

std::optional<SurfaceHit> World::Cast(const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double max_range) const {
  RTCRayHit query{};
  const Eigen::Vector3f o = origin.cast<float>(), d = direction.cast<float>();
  query.ray.org_x = o.x(), query.ray.org_y = o.y(), query.ray.org_z = o.z();
  query.ray.dir_x = d.x(), query.ray.dir_y = d.y(), query.ray.dir_z = d.z();
  query.ray.tfar = static_cast<float>(max_range);
  query.ray.mask = 0xffffffffU;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  internal::IntersectRay(scene_->scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Eigen::Vector3d normal =
      Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).cast<double>().normalized();
  if (normal.dot(direction) > 0.0) normal = -normal;
  const std::uint16_t material = scene_->mesh.triangle_materials[query.hit.primID];
  return SurfaceHit{
      .range = query.ray.tfar, .normal = normal, .material = &scene_->mesh.materials[material]};
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

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/embree_mesh.h"

#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>

#include "mlvi/base/error.h"

namespace mlvi::internal {
namespace {

template <typename Element>
Element* NewBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t size) {
  static_assert(sizeof(Element) == 12, "three packed 32-bit numbers");
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(Element), size);
  MLVI_CHECK(buffer != nullptr, "no memory for {} elements", size);
  return static_cast<Element*>(buffer);
}

RTCRay RayOf(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float max_range) {
  RTCRay ray{};
  ray.org_x = origin.x(), ray.org_y = origin.y(), ray.org_z = origin.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tfar = max_range;
  ray.mask = 0xffffffffU;
  return ray;
}

template <std::size_t N>
void SetRays(const RayPacketOf<N>& packet, typename EmbreePacket<N>::Rays& rays, int* valid) {
  std::ranges::copy(packet.x, rays.org_x);
  std::ranges::copy(packet.y, rays.org_y);
  std::ranges::copy(packet.z, rays.org_z);
  std::ranges::copy(packet.dx, rays.dir_x);
  std::ranges::copy(packet.dy, rays.dir_y);
  std::ranges::copy(packet.dz, rays.dir_z);
  std::ranges::copy(packet.limit, rays.tfar);
  for (int i = 0; i < packet.kSize; ++i) {
    rays.tnear[i] = rays.time[i] = 0.0F;
    rays.mask[i] = 0xffffffffU;
    rays.flags[i] = 0;
    valid[i] = packet.IsActive(i) ? -1 : 0;
  }
}

// Builds the tree in one thread: it, and with it the choice between triangles hit at equal range,
// is the same on every run. In an arena of one, as Embree's own setting ("threads=1") would limit
// the threads of the whole process.
void Commit(RTCScene scene) {
  tbb::task_arena(1).execute([scene] { rtcCommitScene(scene); });
}

}  // namespace

EmbreeDevice::EmbreeDevice() : device_(rtcNewDevice(nullptr)) {
  MLVI_CHECK(device_ != nullptr, "Embree has no device: error {}",
             static_cast<int>(rtcGetDeviceError(nullptr)));
}

EmbreeMesh::EmbreeMesh(const EmbreeDevice& device, const TriangleMesh& mesh) {
  std::vector<std::uint32_t> solid, transparent;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const bool passes = mesh.materials[mesh.triangle_materials[i]].transmission > 0.0;
    (passes ? transparent : solid).push_back(i);
  }
  const auto new_scene = [&] {
    RTCScene scene = rtcNewScene(device.get());
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // watertight edges
    return scene;
  };
  all_ = new_scene();
  opaque_ = transparent.empty() ? all_ : new_scene();
  Attach(device, mesh, std::move(solid), true);
  Attach(device, mesh, std::move(transparent), false);
  Commit(all_);
  if (opaque_ != all_) Commit(opaque_);
}

void EmbreeMesh::Attach(const EmbreeDevice& device, const TriangleMesh& mesh,
                        std::vector<std::uint32_t> triangles, bool opaque) {
  if (triangles.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = NewBuffer<Eigen::Vector3f>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3,
                                              mesh.vertices.size());
  std::copy(mesh.vertices.begin(), mesh.vertices.end(), vertices);
  auto* indices = NewBuffer<std::array<std::uint32_t, 3>>(geometry, RTC_BUFFER_TYPE_INDEX,
                                                          RTC_FORMAT_UINT3, triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) indices[i] = mesh.triangles[triangles[i]];
  rtcCommitGeometry(geometry);
  const auto id = static_cast<unsigned>(facets_.size());
  rtcAttachGeometryByID(all_, geometry, id);
  if (opaque && opaque_ != all_) rtcAttachGeometryByID(opaque_, geometry, id);
  rtcReleaseGeometry(geometry);
  auto& facets = facets_.emplace_back();
  for (const std::uint32_t i : triangles) {
    const auto& t = mesh.triangles[i];
    const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                          &c = mesh.vertices[t[2]];
    facets.push_back({.triangle = i, .normal = (b - a).cross(c - a).normalized()});
  }
}

EmbreeMesh::EmbreeMesh(EmbreeMesh&& other) noexcept
    : all_(std::exchange(other.all_, nullptr)),
      opaque_(std::exchange(other.opaque_, nullptr)),
      facets_(std::move(other.facets_)) {}

EmbreeMesh::~EmbreeMesh() {
  if (all_ == nullptr) return;
  if (opaque_ != all_) rtcReleaseScene(opaque_);
  rtcReleaseScene(all_);
}

std::optional<MeshHit> EmbreeMesh::Cast(const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction, double max_range) const {
  RTCRayHit query{};
  query.ray = RayOf(origin.cast<float>(), direction.cast<float>(), static_cast<float>(max_range));
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  Intersect(all_, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return MeshHit{.range = query.ray.tfar,
                 .normal = {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z},
                 .triangle = facets_[query.hit.geomID][query.hit.primID].triangle,
                 .u = query.hit.u,
                 .v = query.hit.v};
}

bool EmbreeMesh::Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                          double max_range) const {
  RTCRay ray = RayOf(origin.cast<float>(), direction.cast<float>(), static_cast<float>(max_range));
  internal::Occluded(opaque_, ray);
  return ray.tfar < 0.0F;
}

template <std::size_t N>
void EmbreeMesh::Cast(const RayPacketOf<N>& rays, PacketHitsOf<N>& hits) const {
  const auto set = [&](int i, unsigned geometry, unsigned primitive, float range, float u,
                       float v) {
    const Facet& facet = facets_[geometry][primitive];
    PacketHit& hit = hits[static_cast<std::size_t>(i)];
    hit.range = range;
    hit.normal =
        facet.normal.dot(rays.Direction(i)) > 0.0F ? Eigen::Vector3f(-facet.normal) : facet.normal;
    hit.triangle = facet.triangle;
    hit.barycentric = {u, v};
  };
  if (std::has_single_bit(rays.active)) {
    const int i = std::countr_zero(rays.active);
    RTCRayHit query{};
    query.ray = RayOf(rays.Origin(i), rays.Direction(i), rays.limit[static_cast<std::size_t>(i)]);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    Intersect(all_, query);
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID)
      set(i, query.hit.geomID, query.hit.primID, query.ray.tfar, query.hit.u, query.hit.v);
    return;
  }
  typename EmbreePacket<N>::RayHits query;
  alignas(4 * N) std::array<int, N> valid;
  SetRays(rays, query.ray, valid.data());
  for (std::size_t i = 0; i < N; ++i) {
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  Intersect<N>(all_, valid.data(), rays.coherent, query);
  for (int i = 0; i < rays.kSize; ++i) {
    if (!rays.IsActive(i) || query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    set(i, query.hit.geomID[i], query.hit.primID[i], query.ray.tfar[i], query.hit.u[i],
        query.hit.v[i]);
  }
}

template <std::size_t N>
unsigned EmbreeMesh::Occluded(const RayPacketOf<N>& rays) const {
  if (std::has_single_bit(rays.active)) {
    const int i = std::countr_zero(rays.active);
    RTCRay ray = RayOf(rays.Origin(i), rays.Direction(i), rays.limit[static_cast<std::size_t>(i)]);
    internal::Occluded(opaque_, ray);
    return ray.tfar < 0.0F ? rays.active : 0U;
  }
  typename EmbreePacket<N>::Rays query;
  alignas(4 * N) std::array<int, N> valid;
  SetRays(rays, query, valid.data());
  internal::Occluded<N>(opaque_, valid.data(), rays.coherent, query);
  unsigned occluded = 0;
  for (int i = 0; i < rays.kSize; ++i) {
    if (rays.IsActive(i) && query.tfar[i] < 0.0F) occluded |= 1U << i;
  }
  return occluded;
}

template void EmbreeMesh::Cast(const RayPacketOf<8>&, PacketHitsOf<8>&) const;
template void EmbreeMesh::Cast(const RayPacketOf<16>&, PacketHitsOf<16>&) const;
template unsigned EmbreeMesh::Occluded(const RayPacketOf<8>&) const;
template unsigned EmbreeMesh::Occluded(const RayPacketOf<16>&) const;

}  // namespace mlvi::internal

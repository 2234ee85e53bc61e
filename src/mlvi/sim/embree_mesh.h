// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// A triangle mesh in Embree: everything that the simulator asks of it.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "mlvi/sim/embree.h"
#include "mlvi/sim/ray_packet.h"
#include "mlvi/sim/world.h"

namespace mlvi::internal {

class EmbreeDevice {
 public:
  EmbreeDevice();
  ~EmbreeDevice() { rtcReleaseDevice(device_); }
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  RTCDevice get() const { return device_; }

 private:
  RTCDevice device_;
};

struct MeshHit {
  float range = 0.0F;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // not normalised, on either side
  std::uint32_t triangle = 0;                        // of the mesh
  float u = 0.0F, v = 0.0F;                          // weights of its second and third vertex
};

class EmbreeMesh {
 public:
  // Copies what it needs. `mesh` is valid (World checks it).
  EmbreeMesh(const EmbreeDevice& device, const TriangleMesh& mesh);
  ~EmbreeMesh();
  EmbreeMesh(EmbreeMesh&& other) noexcept;
  EmbreeMesh& operator=(EmbreeMesh&&) = delete;

  std::optional<MeshHit> Cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                              double max_range) const;
  // Whether a triangle that lets no light through lies within.
  bool Occluded(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                double max_range) const;

  // The same for packets. Cast leaves `hits` of rays that meet nothing or are not active as they
  // are; Occluded returns the bits of those rays that something lies on.
  template <std::size_t N>
  void Cast(const RayPacketOf<N>& rays, PacketHitsOf<N>& hits) const;
  template <std::size_t N>
  unsigned Occluded(const RayPacketOf<N>& rays) const;

 private:
  struct Facet {
    std::uint32_t triangle = 0;                        // of the mesh
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, on either side
  };
  void Attach(const EmbreeDevice& device, const TriangleMesh& mesh,
              std::vector<std::uint32_t> triangles, bool opaque);

  RTCScene all_ = nullptr;
  RTCScene opaque_ = nullptr;  // without what transmits light; the same as `all_` if nothing does
  std::vector<std::vector<Facet>> facets_;  // by geometry of Embree
};

}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The one place that knows whether Embree 3 (Debian 12, Ubuntu 22.04) or 4 (Ubuntu 24.04) is
// installed.
#pragma once

#include <cstddef>

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace mlvi::internal {

// Queries of one ray, and of packets. `valid` of the latter: -1 for rays to trace, 0 for others; it
// and the rays are aligned to 4 N bytes. `coherent`: the rays run much the same way and share the
// way through the tree. Intersect finds the first hit; Occluded sets ray.tfar to minus infinity
// where anything lies on the ray.
template <std::size_t N>
struct EmbreePacket;
template <>
struct EmbreePacket<8> {
  using Rays = RTCRay8;
  using RayHits = RTCRayHit8;
  static constexpr auto kIntersect = rtcIntersect8;
  static constexpr auto kOccluded = rtcOccluded8;
};
template <>
struct EmbreePacket<16> {
  using Rays = RTCRay16;
  using RayHits = RTCRayHit16;
  static constexpr auto kIntersect = rtcIntersect16;
  static constexpr auto kOccluded = rtcOccluded16;
};

#if RTC_VERSION_MAJOR >= 4
inline RTCRayQueryFlags QueryFlags(bool coherent) {
  return coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
}
inline void Intersect(RTCScene scene, RTCRayHit& ray_hit) { rtcIntersect1(scene, &ray_hit); }
inline void Occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
template <std::size_t N>
void Intersect(RTCScene scene, const int* valid, bool coherent,
               typename EmbreePacket<N>::RayHits& ray_hits) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = QueryFlags(coherent);
  EmbreePacket<N>::kIntersect(valid, scene, &ray_hits, &arguments);
}
template <std::size_t N>
void Occluded(RTCScene scene, const int* valid, bool coherent,
              typename EmbreePacket<N>::Rays& rays) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = QueryFlags(coherent);
  EmbreePacket<N>::kOccluded(valid, scene, &rays, &arguments);
}
#else
inline RTCIntersectContext Context(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}
inline void Intersect(RTCScene scene, RTCRayHit& ray_hit) {
  RTCIntersectContext context = Context(false);
  rtcIntersect1(scene, &context, &ray_hit);
}
inline void Occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context = Context(false);
  rtcOccluded1(scene, &context, &ray);
}
template <std::size_t N>
void Intersect(RTCScene scene, const int* valid, bool coherent,
               typename EmbreePacket<N>::RayHits& ray_hits) {
  RTCIntersectContext context = Context(coherent);
  EmbreePacket<N>::kIntersect(valid, scene, &context, &ray_hits);
}
template <std::size_t N>
void Occluded(RTCScene scene, const int* valid, bool coherent,
              typename EmbreePacket<N>::Rays& rays) {
  RTCIntersectContext context = Context(coherent);
  EmbreePacket<N>::kOccluded(valid, scene, &context, &rays);
}
#endif

}  // namespace mlvi::internal

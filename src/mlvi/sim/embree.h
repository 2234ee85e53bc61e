// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
//
// The one place that knows whether Embree 3 (Debian 12, Ubuntu 22.04) or 4 (Ubuntu 24.04) is
// installed.
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace mlvi::internal {

// Queries of one ray, and of eight that run much the same way. `valid` of the latter: -1 for rays
// to trace, 0 for others; 32-byte alignment. Intersect finds the first hit; Occluded sets ray.tfar
// to minus infinity where anything lies on the ray.
#if RTC_VERSION_MAJOR >= 4
inline RTCIntersectArguments CoherentIntersection() {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  return arguments;
}
inline RTCOccludedArguments CoherentOcclusion() {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  return arguments;
}
inline void Intersect(RTCScene scene, RTCRayHit& ray_hit) { rtcIntersect1(scene, &ray_hit); }
inline void Occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
inline void Intersect(RTCScene scene, const int* valid, RTCRayHit8& ray_hits) {
  RTCIntersectArguments arguments = CoherentIntersection();
  rtcIntersect8(valid, scene, &ray_hits, &arguments);
}
inline void Occluded(RTCScene scene, const int* valid, RTCRay8& rays) {
  RTCOccludedArguments arguments = CoherentOcclusion();
  rtcOccluded8(valid, scene, &rays, &arguments);
}
#else
inline RTCIntersectContext Context(RTCIntersectContextFlags flags) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}
inline void Intersect(RTCScene scene, RTCRayHit& ray_hit) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcIntersect1(scene, &context, &ray_hit);
}
inline void Occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  rtcOccluded1(scene, &context, &ray);
}
inline void Intersect(RTCScene scene, const int* valid, RTCRayHit8& ray_hits) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcIntersect8(valid, scene, &context, &ray_hits);
}
inline void Occluded(RTCScene scene, const int* valid, RTCRay8& rays) {
  RTCIntersectContext context = Context(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  rtcOccluded8(valid, scene, &context, &rays);
}
#endif

}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_echoes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/sim/averaged_relief.h"

namespace mlvi {
namespace {

constexpr double kRetroGain = 300.0;
constexpr double kGlintSlope = 0.0087;  // rad
constexpr int kMaxDepth = 3;            // surfaces on one path
constexpr double kLeastEnergy = 0.02;   // of a pulse that is followed on
constexpr double kOffTheWall = 0.002;   // m
constexpr double kCoherent = 0.95;      // cosine between pulses that are traced as one bundle

bool IsSmooth(const Material& material) {
  return material.lidar_mirror > 0.0 || material.transmission > 0.0;
}

// Puts an echo from `point` of the mesh of a static surface on the relief of its material.
void PutOnRelief(const World& world, const Material& material, const Eigen::Vector3d& point,
                 const Eigen::Vector3d& direction, const LidarPhysics& physics, LidarEcho& echo) {
  if (physics.plane_surfaces || material.relief.plane()) return;
  const Relief relief = AveragedRelief(material.relief, echo.spread * echo.range, echo.cosine);
  echo.relief = world.relief().ShortensBy(relief, point, direction, echo.cosine);
  echo.range -= echo.relief;
}

// One ray of a pulse on its way.
struct Stretch {
  Eigen::Vector3d origin, direction;
  double travelled = 0.0;  // m
  double energy = 1.0;     // of what it started with
  EchoPath path = EchoPath::kDirect;
  int depth = 0;        // surfaces met
  double spread = 0.0;  // rad, one sigma of the beam that the ray stands for
};

void Follow(const WorldSnapshot& world, const Stretch& at, const LidarPhysics& physics,
            double weight, std::vector<LidarEcho>& echoes);

// Of what a ray meets at the end of a stretch.
LidarEcho EchoAt(const World& world, const Stretch& at, const SurfaceHit& hit,
                 const LidarPhysics& physics) {
  const double cosine = -hit.normal.dot(at.direction);
  LidarEcho echo = EchoOf(*hit.material, cosine, at.travelled + hit.range, at.energy);
  echo.path = at.path;
  echo.spread = at.spread;
  if (hit.object < 0) {
    PutOnRelief(world, *hit.material, at.origin + hit.range * at.direction, at.direction, physics,
                echo);
  }
  return echo;
}

// Appends that echo, and those of all that lies behind.
void Return(const WorldSnapshot& world, const Stretch& at, const SurfaceHit& hit,
            const LidarPhysics& physics, double weight, std::vector<LidarEcho>& echoes) {
  const Material& material = *hit.material;
  const double cosine = -hit.normal.dot(at.direction), range = at.travelled + hit.range;
  const Eigen::Vector3d point = at.origin + hit.range * at.direction;
  echoes.push_back(EchoAt(world.world(), at, hit, physics));
  echoes.back().weight = weight;
  if (!IsSmooth(material) || at.depth + 1 >= kMaxDepth) return;
  const auto go_on = [&](double share, const Eigen::Vector3d& onward, EchoPath path) {
    if (share * at.energy < kLeastEnergy) return;
    Follow(world,
           {.origin = point + kOffTheWall * onward,
            .direction = onward,
            .travelled = range + kOffTheWall,
            .energy = share * at.energy,
            .path = std::max(path, at.path),
            .depth = at.depth + 1},
           physics, weight, echoes);
  };
  go_on(MirroredShare(material.lidar_mirror, cosine), at.direction + 2.0 * cosine * hit.normal,
        EchoPath::kMirrored);
  go_on(TransmittedShare(material.transmission, material.lidar_mirror, cosine), at.direction,
        EchoPath::kTransmitted);
}

void Follow(const WorldSnapshot& world, const Stretch& at, const LidarPhysics& physics,
            double weight, std::vector<LidarEcho>& echoes) {
  const auto hit = world.Cast(at.origin, at.direction, physics.max_range - at.travelled);
  if (hit) Return(world, at, *hit, physics, weight, echoes);
}

LidarReturn Alone(const LidarEcho& echo) {
  return {.range = echo.range,
          .nearest = echo.range,
          .farthest = echo.range,
          .reflectivity = echo.weight * echo.reflectivity,
          .cosine = echo.cosine,
          .path = echo.path,
          .relief = echo.relief,
          .spread = echo.spread,
          .echoes = 1};
}

LidarReturn Joined(std::span<const LidarEcho> echoes) {
  if (echoes.size() == 1) return Alone(echoes.front());
  double power = 0.0, moment = 0.0;
  for (const LidarEcho& echo : echoes) power += echo.power(), moment += echo.power() * echo.range;
  const auto strongest = std::ranges::max_element(echoes, {}, &LidarEcho::power);
  const double range = power > 0.0 ? moment / power : echoes.front().range;
  return {.range = range,
          .nearest = echoes.front().range,
          .farthest = echoes.back().range,
          .reflectivity = power * range * range,
          .cosine = strongest->cosine,
          .path = strongest->path,
          .relief = strongest->relief,
          .spread = strongest->spread,
          .echoes = static_cast<int>(echoes.size())};
}

// A pulse as rays, and what each of them met first.
struct Beam {
  std::array<Eigen::Vector3d, kBeamRays> directions;
  std::span<const PacketHit> hits;  // of as many of the directions as are traced
};

// Whether all rays of a beam meet one diffuse plane.
enum class BeamMeets { kNothing, kPlane, kMore };
BeamMeets WhatMeets(const World& world, const Beam& beam) {
  const PacketHit& middle = beam.hits.front();
  const auto distance = [&](std::size_t i) {
    const PacketHit& hit = beam.hits[i];
    return hit.range * hit.normal.dot(beam.directions[i].cast<float>());
  };
  const float plane = distance(0);
  std::size_t missed = 0;
  bool plain = true;
  for (std::size_t i = 0; i < beam.hits.size(); ++i) {
    const PacketHit& hit = beam.hits[i];
    if (hit.range == 0.0F) {
      ++missed;
      continue;
    }
    const Material& material = world.MaterialOf(hit);
    plain = plain && !IsSmooth(material) &&
            material.retroreflective == world.MaterialOf(middle).retroreflective &&
            hit.object == middle.object && hit.normal.dot(middle.normal) > 0.99F &&
            std::abs(distance(i) - plane) < 0.01F;
  }
  if (missed == beam.hits.size()) return BeamMeets::kNothing;
  return plain && missed == 0 ? BeamMeets::kPlane : BeamMeets::kMore;
}

SurfaceHit SurfaceOf(const World& world, const PacketHit& hit) {
  return {.range = hit.range,
          .normal = hit.normal.cast<double>(),
          .material = &world.MaterialOf(hit),
          .object = hit.object};
}

// What the receiver makes of a pulse.
std::optional<LidarReturn> ReturnOf(const Pulse& pulse, const Beam& beam,
                                    const LidarPhysics& physics) {
  const World& world = pulse.world->world();
  const BeamMeets meets = WhatMeets(world, beam);
  if (meets == BeamMeets::kNothing) return std::nullopt;
  const auto way = [&](std::size_t i, double spread) {
    return Stretch{.origin = pulse.origin, .direction = beam.directions[i], .spread = spread};
  };
  if (meets == BeamMeets::kPlane) {
    const SurfaceHit middle = SurfaceOf(world, beam.hits.front());
    return Alone(EchoAt(world, way(0, BeamDeviation(physics.beam_divergence)), middle, physics));
  }
  std::vector<LidarEcho> echoes;
  for (std::size_t i = 0; i < beam.hits.size(); ++i) {
    if (beam.hits[i].range == 0.0F) continue;
    const double weight = beam.hits.size() == 1 ? 1.0 : BeamWeight(i);
    Return(*pulse.world, way(i, 0.0), SurfaceOf(world, beam.hits[i]), physics, weight, echoes);
  }
  return StrongestReturn(echoes, physics.pulse_length);
}

std::optional<LidarReturn> FirstSurface(const WorldSnapshot& world, const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction, double max_range) {
  const auto hit = world.Cast(origin, direction, max_range);
  if (!hit) return std::nullopt;
  const double cosine = -hit->normal.dot(direction);
  return Alone({.range = hit->range,
                .reflectivity = hit->material->reflectivity * cosine,
                .cosine = cosine});
}

}  // namespace

LidarEcho EchoOf(const Material& material, double cosine, double range, double energy) {
  double reflectivity = material.reflectivity * cosine;
  if (material.retroreflective) reflectivity *= kRetroGain;
  if (material.lidar_mirror > 0.0 && cosine > 0.9) {
    const double cosine2 = cosine * cosine, tangent2 = 1.0 / cosine2 - 1.0;
    constexpr double kVariance = kGlintSlope * kGlintSlope;
    reflectivity += material.lidar_mirror * std::exp(-0.5 * tangent2 / kVariance) /
                    (8.0 * kVariance * cosine2 * cosine2);
  }
  return {.range = range, .reflectivity = energy * energy * reflectivity, .cosine = cosine};
}

void TracePulse(const WorldSnapshot& world, const Eigen::Vector3d& origin,
                const Eigen::Vector3d& direction, const LidarPhysics& physics, double weight,
                std::vector<LidarEcho>& echoes) {
  Follow(world, {.origin = origin, .direction = direction}, physics, weight, echoes);
}

std::optional<LidarReturn> StrongestReturn(std::vector<LidarEcho>& echoes, double pulse_length) {
  std::ranges::stable_sort(echoes, {}, &LidarEcho::range);
  std::optional<LidarReturn> strongest;
  const auto power = [](const LidarReturn& r) { return r.reflectivity / (r.range * r.range); };
  for (auto first = echoes.begin(); first != echoes.end();) {
    const auto next = std::find_if(first, echoes.end(), [&](const LidarEcho& echo) {
      return echo.range - first->range > pulse_length;
    });
    const LidarReturn joint = Joined({first, next});
    if (!strongest || power(joint) > power(*strongest)) strongest = joint;
    first = next;
  }
  return strongest;
}

std::array<Eigen::Vector3d, kBeamRays> BeamDirections(const Eigen::Vector3d& direction,
                                                      double divergence) {
  const double reach = 2.0 * BeamDeviation(divergence);
  const Eigen::Vector3d u = reach * direction.unitOrthogonal(), v = direction.cross(u);
  return {direction, (direction + u).normalized(), (direction + v).normalized(),
          (direction - u).normalized(), (direction - v).normalized()};
}

namespace {

// Whether a bundle may be traced as one. Embree misses surfaces then where rays run towards different
// sides of an axis (1 % of the beams of a PandarXT-32 in the basement), and of bundles without width.
bool AreCoherent(std::span<const Pulse> pulses, const WideRayPacket& packet) {
  const bool narrow = std::ranges::all_of(pulses, [&](const Pulse& pulse) {
    return pulse.direction.dot(pulses.front().direction) > kCoherent;
  });
  const auto one_side = [&](const WideRayPacket::Lanes& lanes) {
    const auto all = std::span(lanes).first(static_cast<std::size_t>(std::popcount(packet.active)));
    return std::ranges::all_of(all, [](float x) { return x > 0.0F; }) ||
           std::ranges::all_of(all, [](float x) { return x < 0.0F; });
  };
  return narrow && one_side(packet.dx) && one_side(packet.dy) && one_side(packet.dz);
}

}  // namespace

PulseReturns ReceivePulses(std::span<const Pulse> pulses, const LidarPhysics& physics) {
  MLVI_CHECK(pulses.size() <= kPulsesTogether, "{} pulses at once", pulses.size());
  PulseReturns returns;
  if (physics.first_surface) {
    std::ranges::transform(pulses, returns.begin(), [&](const Pulse& pulse) {
      return FirstSurface(*pulse.ahead, pulse.origin, pulse.direction, physics.max_range);
    });
    return returns;
  }
  static_assert(kPulsesTogether * kBeamRays <= WideRayPacket::kSize);
  const std::size_t rays = physics.beam_divergence > 0.0 ? kBeamRays : 1;
  std::array<Beam, kPulsesTogether> beams;
  WideRayPacket packet;
  WorldSnapshot::PerRayOf<WideRayPacket::kSize> snapshots;
  snapshots.fill(pulses.front().ahead);
  for (std::size_t k = 0; k < pulses.size(); ++k) {
    beams[k].directions = BeamDirections(pulses[k].direction, physics.beam_divergence);
    for (std::size_t i = 0; i < rays; ++i) {
      packet.Set(static_cast<int>(k * rays + i), pulses[k].origin.cast<float>(),
                 beams[k].directions[i].cast<float>(), static_cast<float>(physics.max_range));
      snapshots[k * rays + i] = pulses[k].ahead;
    }
  }
  packet.coherent = rays > 1 && AreCoherent(pulses, packet);
  const auto hits = WorldSnapshot::Cast(packet, snapshots);
  for (std::size_t k = 0; k < pulses.size(); ++k) {
    beams[k].hits = std::span(hits).subspan(k * rays, rays);
    returns[k] = ReturnOf(pulses[k], beams[k], physics);
  }
  return returns;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_echoes.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace mlvi {
namespace {

constexpr double kRetroGain = 300.0;
constexpr double kGlintSlope = 0.0087;  // rad
constexpr int kMaxDepth = 3;            // surfaces on one path
constexpr double kLeastEnergy = 0.02;   // of a pulse that is followed on
constexpr double kOffTheWall = 0.002;   // m

bool IsSmooth(const Material& material) {
  return material.lidar_mirror > 0.0 || material.transmission > 0.0;
}

// Puts an echo from `point` of the mesh of a static surface on the relief of its material.
void PutOnRelief(const World& world, const Material& material, const Eigen::Vector3d& point,
                 const Eigen::Vector3d& direction, const LidarPhysics& physics, LidarEcho& echo) {
  if (physics.plane_surfaces || material.relief.plane()) return;
  echo.relief = world.relief().ShortensBy(material.relief, point, direction, echo.cosine);
  echo.range -= echo.relief;
}

// One ray of a pulse on its way.
struct Stretch {
  Eigen::Vector3d origin, direction;
  double travelled = 0.0;  // m
  double energy = 1.0;     // of what it started with
  EchoPath path = EchoPath::kDirect;
  int depth = 0;  // surfaces met
};

void Follow(const WorldSnapshot& world, const Stretch& at, const LidarPhysics& physics,
            double weight, std::vector<LidarEcho>& echoes) {
  const auto hit = world.Cast(at.origin, at.direction, physics.max_range - at.travelled);
  if (!hit) return;
  const Material& material = *hit->material;
  const double cosine = -hit->normal.dot(at.direction), range = at.travelled + hit->range;
  LidarEcho& echo = echoes.emplace_back(EchoOf(material, cosine, range, at.energy));
  echo.weight = weight;
  echo.path = at.path;
  const Eigen::Vector3d point = at.origin + hit->range * at.direction;
  if (hit->object < 0) PutOnRelief(world.world(), material, point, at.direction, physics, echo);
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
  go_on(MirroredShare(material.lidar_mirror, cosine), at.direction + 2.0 * cosine * hit->normal,
        EchoPath::kMirrored);
  go_on(TransmittedShare(material.transmission, material.lidar_mirror, cosine), at.direction,
        EchoPath::kTransmitted);
}

LidarReturn Alone(const LidarEcho& echo) {
  return {.range = echo.range,
          .nearest = echo.range,
          .farthest = echo.range,
          .reflectivity = echo.weight * echo.reflectivity,
          .cosine = echo.cosine,
          .path = echo.path,
          .relief = echo.relief,
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
          .echoes = static_cast<int>(echoes.size())};
}

// The middle ray of the beam where all of them meet one diffuse plane.
enum class BeamMeets { kNothing, kPlane, kMore };
BeamMeets WhatMeets(const World& world, const RayPacket& beam, const PacketHits& hits, int rays) {
  const PacketHit& middle = hits[0];
  const float plane = middle.range * middle.normal.dot(beam.Direction(0));
  int missed = 0;
  bool plain = true;
  for (int i = 0; i < rays; ++i) {
    const PacketHit& hit = hits[static_cast<std::size_t>(i)];
    if (hit.range == 0.0F) {
      ++missed;
      continue;
    }
    plain = plain && !IsSmooth(world.MaterialOf(hit)) && hit.normal.dot(middle.normal) > 0.99F &&
            std::abs(hit.range * hit.normal.dot(beam.Direction(i)) - plane) < 0.01F;
  }
  if (missed == rays) return BeamMeets::kNothing;
  return plain && missed == 0 ? BeamMeets::kPlane : BeamMeets::kMore;
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
  const double reach = 2.0 * divergence / (2.0 * std::sqrt(2.0 * std::log(2.0)));
  const Eigen::Vector3d u = reach * direction.unitOrthogonal(), v = direction.cross(u);
  return {direction, (direction + u).normalized(), (direction + v).normalized(),
          (direction - u).normalized(), (direction - v).normalized()};
}

std::optional<LidarReturn> ReceivePulse(const WorldSnapshot& world, const WorldSnapshot& ahead,
                                        const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction,
                                        const LidarPhysics& physics) {
  if (physics.first_surface) return FirstSurface(ahead, origin, direction, physics.max_range);
  const bool line = physics.beam_divergence <= 0.0;
  const auto directions = BeamDirections(direction, physics.beam_divergence);
  const int rays = line ? 1 : static_cast<int>(kBeamRays);
  RayPacket beam;
  for (int i = 0; i < rays; ++i) {
    beam.Set(i, origin.cast<float>(), directions[static_cast<std::size_t>(i)].cast<float>(),
             static_cast<float>(physics.max_range));
  }
  WorldSnapshot::PerRay snapshots;
  snapshots.fill(&ahead);
  const PacketHits hits = WorldSnapshot::Cast(beam, snapshots);
  const BeamMeets meets = WhatMeets(world.world(), beam, hits, rays);
  if (meets == BeamMeets::kNothing) return std::nullopt;
  if (meets == BeamMeets::kPlane) {
    const PacketHit& middle = hits[0];
    const Material& material = world.world().MaterialOf(middle);
    LidarEcho echo = EchoOf(material, -middle.normal.dot(beam.Direction(0)), middle.range, 1.0);
    if (middle.object < 0) {
      PutOnRelief(world.world(), material, origin + middle.range * direction, direction, physics,
                  echo);
    }
    return Alone(echo);
  }
  std::vector<LidarEcho> echoes;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rays); ++i) {
    TracePulse(world, origin, directions[i], physics, line ? 1.0 : BeamWeight(i), echoes);
  }
  return StrongestReturn(echoes, physics.pulse_length);
}

}  // namespace mlvi

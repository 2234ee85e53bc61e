// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/lidar_simulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "mlvi/base/parallel.h"

namespace mlvi {
namespace {

// Moving objects stand still for so long, ns: 0.3 mm of a quick walk.
constexpr std::int32_t kInstant = 200'000;

// A unit vector near `direction`: normal angles of `sigma` rad about two axes across it.
Eigen::Vector3d Disturbed(const Eigen::Vector3d& direction, double sigma, RandomStream& random) {
  const double a = sigma * random.Normal(), b = sigma * random.Normal();
  const Eigen::Vector3d across = direction.unitOrthogonal();
  return (direction + a * across + b * direction.cross(across)).normalized();
}

// Probability that a return is detected: rises linearly from 0.5 to 1.5 times the threshold power.
double DetectionProbability(const LidarPhysics& physics, double reflectivity, double range) {
  const double ratio = physics.reference_range / range;
  const double power = reflectivity / 0.8 * ratio * ratio;
  return (1.0 - physics.dropout) * std::clamp(power - 0.5, 0.0, 1.0);
}

}  // namespace

struct LidarSimulator::Shot {
  Pulse pulse;
  double range_error = 0.0;  // m
  double chance = 0.0;       // uniform in [0, 1): of being detected
};

// `still`: the world without what moves.
LidarSimulator::Shot LidarSimulator::Aim(const LidarRay& ray, const Scenery& scenery,
                                         const WorldSnapshot& still, const Pose3& T_world_lidar,
                                         RandomStream random) const {
  const LidarPhysics& physics = pattern_.physics;
  const Eigen::Vector3d direction =
      T_world_lidar.rotation() *
      Disturbed(ray.direction.cast<double>(), physics.beam_noise, random);
  const Eigen::Vector3d origin = T_world_lidar * ray.origin.cast<double>();
  const double range_error = physics.range_noise * random.Normal();
  const bool clear = std::ranges::none_of(
      scenery.moving, [&](const auto& obstacle) { return obstacle.MayBeMet(origin, direction); });
  return {.pulse = {.origin = origin,
                    .direction = direction,
                    .world = &scenery.world,
                    .ahead = clear ? &still : &scenery.world},
          .range_error = range_error,
          .chance = random.Uniform()};
}

LidarPoint LidarSimulator::Measure(const LidarRay& ray, const Shot& shot,
                                   const std::optional<LidarReturn>& echo) const {
  const LidarPhysics& physics = pattern_.physics;
  LidarPoint point{.offset_ns = pattern_.firing_offsets_ns[ray.firing], .ring = ray.ring};
  if (!echo) return point;
  const Eigen::Vector3d origin = ray.origin.cast<double>(), nominal = ray.direction.cast<double>();
  const double range = echo->range + ray.origin_offset;
  if (range < physics.min_range || range > physics.max_range) return point;
  if (shot.chance >= DetectionProbability(physics, echo->reflectivity, range)) return point;
  const double biased = range + RangeBias(physics, range, echo->cosine, echo->reflectivity);
  const double measured =
      std::round((biased + shot.range_error) / physics.range_resolution) * physics.range_resolution;
  if (measured <= ray.origin_offset) return point;
  point.position = (origin + (measured - ray.origin_offset) * nominal).cast<float>();
  point.intensity = static_cast<float>(255.0 * std::min(1.0, echo->reflectivity));
  return point;
}

std::vector<LidarSimulator::Scenery> LidarSimulator::SceneryOf(const World& world,
                                                               const PoseSpline& motion,
                                                               Time stamp) const {
  if (world.movers().empty()) return {{.world = world.StaticSnapshot(), .moving = {}}};
  double reach = 0.001;  // m, the way of the sensor within an instant
  for (const LidarRay& ray : pattern_.rays)
    reach = std::max(reach, 0.001 + static_cast<double>(ray.origin.norm()));
  const auto instants = static_cast<std::size_t>(pattern_.firing_offsets_ns.back() / kInstant) + 1;
  std::vector<Scenery> result(instants, {.world = world.StaticSnapshot(), .moving = {}});
  ParallelFor(instants, 64, [&](std::size_t i) {
    const std::int64_t middle = static_cast<std::int64_t>(i) * kInstant + kInstant / 2;
    const std::int64_t offset = std::min<std::int64_t>(middle, pattern_.firing_offsets_ns.back());
    const Time time = stamp + Duration::FromNanoseconds(offset);
    result[i].world = world.At(time);
    const Eigen::Vector3d lidar = motion.PoseAt(time) * T_body_lidar_.translation();
    result[i].moving = result[i].world.MovingParts(lidar, reach);
  });
  return result;
}

TracedSweep LidarSimulator::Trace(const World& world, const PoseSpline& motion, Time stamp,
                                  std::uint64_t index) const {
  const auto& offsets = pattern_.firing_offsets_ns;
  std::vector<Pose3> poses(offsets.size());
  ParallelFor(offsets.size(), 512, [&](std::size_t i) {
    poses[i] = motion.PoseAt(stamp + Duration::FromNanoseconds(offsets[i])) * T_body_lidar_;
  });
  const WorldSnapshot still = world.StaticSnapshot();
  const std::vector<Scenery> scenery = SceneryOf(world, motion, stamp);
  const auto instant = [&](const LidarRay& ray) {
    return scenery.size() > 1 ? static_cast<std::size_t>(offsets[ray.firing] / kInstant) : 0;
  };
  TracedSweep result{.returns = std::vector<LidarReturn>(pattern_.rays.size())};
  LidarSweep& sweep = result.sweep;
  sweep.stamp = stamp;
  sweep.span = pattern_.span();
  sweep.has_times = sweep.has_rings = sweep.has_intensity = true;
  sweep.points.resize(pattern_.rays.size());
  const RandomStream random = random_.Fork(index);
  const std::size_t groups = (pattern_.rays.size() + kPulsesTogether - 1) / kPulsesTogether;
  ParallelFor(groups, 256, [&](std::size_t group) {
    const std::size_t first = group * kPulsesTogether;
    const auto rays = std::span(pattern_.rays)
                          .subspan(first, std::min(kPulsesTogether, pattern_.rays.size() - first));
    std::array<Shot, kPulsesTogether> shots;
    std::array<Pulse, kPulsesTogether> pulses;
    for (std::size_t k = 0; k < rays.size(); ++k) {
      const LidarRay& ray = rays[k];
      shots[k] = Aim(ray, scenery[instant(ray)], still, poses[ray.firing], random.Fork(first + k));
      pulses[k] = shots[k].pulse;
    }
    const PulseReturns echoes =
        ReceivePulses(std::span(pulses).first(rays.size()), pattern_.physics);
    for (std::size_t k = 0; k < rays.size(); ++k) {
      sweep.points[first + k] = Measure(rays[k], shots[k], echoes[k]);
      result.returns[first + k] = echoes[k].value_or(LidarReturn{});
    }
  });
  return result;
}

void KeepReturns(LidarSweep& sweep, double min_range, double max_range) {
  std::erase_if(sweep.points, [&](const LidarPoint& p) {
    const double range = p.position.cast<double>().norm();
    return !(range > 0.0 && range >= min_range && range <= max_range);  // NaN, too
  });
  if (sweep.points.empty()) {
    sweep.span = Duration();
    return;
  }
  const auto by_time = [](const LidarPoint& a, const LidarPoint& b) {
    return a.offset_ns < b.offset_ns;
  };
  const auto [first, last] = std::minmax_element(sweep.points.begin(), sweep.points.end(), by_time);
  const std::int32_t shift = first->offset_ns;
  sweep.span = Duration::FromNanoseconds(last->offset_ns - shift);
  sweep.stamp = sweep.stamp + Duration::FromNanoseconds(shift);
  for (LidarPoint& point : sweep.points) point.offset_ns -= shift;
}

}  // namespace mlvi

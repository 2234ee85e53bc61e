// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_association.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace mlvi {
namespace {

using Neighbors = SphericalDepthMap::Neighbors;

constexpr int kRounds = 4;
// Twice the area of a triangle over the square of its longest side: 0.87 when equilateral, 0 on a
// line.
constexpr double kMinRoundness = 0.25;
// Barycentric coordinates of the meeting point: how far outside of the triangle the plane is
// trusted.
constexpr double kMaxExtrapolation = 1.0;

struct Triangle {
  std::array<Eigen::Vector3d, 3> corners;
  double reach = 0.0;  // rad, angle of the farthest corner from the ray
};

// The nearest neighbour and two others, the farthest as near as can be, that do not lie on one line
// as seen from S.
std::optional<Triangle> ChooseTriangle(const SphericalDepthMap& map, const Neighbors& near) {
  const auto point = [&](int i) { return map.points()[static_cast<std::size_t>(near.index[i])]; };
  const Eigen::Vector3d first = point(0).normalized();
  for (int c = 2; c < near.count; ++c) {
    const Eigen::Vector3d to_c = point(c).normalized() - first;
    for (int b = 1; b < c; ++b) {
      const Eigen::Vector3d to_b = point(b).normalized() - first;
      const double longest =
          std::max({to_b.squaredNorm(), to_c.squaredNorm(), (to_b - to_c).squaredNorm()});
      if (to_b.cross(to_c).norm() > kMinRoundness * longest) {
        return Triangle{{point(0), point(b), point(c)}, near.angle[c]};
      }
    }
  }
  return std::nullopt;
}

// Whether the points within reach of the triangle differ in depth by more than one surface
// explains.
bool IsSpread(const SphericalDepthMap& map, const Neighbors& near, double reach, const Ray& ray,
              const DepthConfig& config) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (int i = 0; i < near.count && near.angle[i] <= reach; ++i) {
    const double depth = (map.points()[near.index[i]] - ray.origin).norm();
    least = std::min(least, depth);
    most = std::max(most, depth);
  }
  return most - least > std::max(config.min_spread, config.max_spread_ratio * least);
}

// With weights w_k, barycentric at the meeting point, n the normal, f the ray and b_k the beams:
//   depth = n . (p_0 - C) / (n . f),   d depth = sum_k w_k n . dp_k / (n . f),
// and a turn of the ray by d theta towards the plane moves it by depth d theta / tan(incidence).
FeatureDepth Intersect(const Triangle& triangle, const Ray& ray, const DepthConfig& config) {
  const auto& [a, b, c] = triangle.corners;
  const Eigen::Vector3d n = (b - a).cross(c - a).normalized();
  const double sine = n.dot(ray.direction);
  FeatureDepth result{.status = DepthStatus::kGrazing};
  if (!(std::abs(sine) > config.min_incidence)) return result;
  result.depth = n.dot(a - ray.origin) / sine;
  if (!(result.depth >= config.min_depth && result.depth <= config.max_depth)) return result;
  const Eigen::Vector3d point = ray.At(result.depth);
  const double area = n.dot((b - a).cross(c - a));
  const std::array<double, 3> weights = {n.dot((b - point).cross(c - point)) / area,
                                         n.dot((c - point).cross(a - point)) / area,
                                         n.dot((a - point).cross(b - point)) / area};
  double variance = 0.0;
  for (int k = 0; k < 3; ++k) {
    if (weights[k] < -kMaxExtrapolation || weights[k] > 1.0 + kMaxExtrapolation) return result;
    const double along_beam = n.dot(triangle.corners[k].normalized()) * config.range_noise;
    variance +=
        weights[k] * weights[k] * (along_beam * along_beam + config.roughness * config.roughness);
  }
  const double turned = result.depth * ray.sigma;
  result.variance = (variance + turned * turned * (1.0 - sine * sine)) / (sine * sine);
  result.status = DepthStatus::kFound;
  return result;
}

}  // namespace

FeatureDepth AssociateDepth(const SphericalDepthMap& map, const Ray& ray,
                            const DepthConfig& config) {
  Eigen::Vector3d seek = ray.direction;
  FeatureDepth result;
  for (int round = 0; round < kRounds; ++round) {
    const double reach = round == 0
                             ? config.max_neighbor_angle + ray.origin.norm() / config.min_depth
                             : config.max_neighbor_angle;
    const Neighbors near =
        map.Nearest(seek, std::min(config.neighbors, Neighbors::kCapacity), reach);
    if (near.count < 3) return {};
    // The first round asks in the direction of the ray at infinity, for a guess of its depth only.
    const auto triangle = ChooseTriangle(map, near);
    const double guess = (map.points()[near.index[0]] - ray.origin).norm();
    if (!triangle) {
      result = {.status = DepthStatus::kNoPoints};
    } else if (IsSpread(map, near, triangle->reach, ray, config)) {
      result = {.status = DepthStatus::kSpread};
    } else {
      result = Intersect(*triangle, ray, config);
    }
    const double depth = result.status == DepthStatus::kFound ? result.depth : guess;
    const Eigen::Vector3d next = ray.At(depth).normalized();
    const double moved = (next - seek).norm();
    seek = next;
    if (round > 0 && moved < 0.1 * config.cell_angle) break;
  }
  return result;
}

}  // namespace mlvi

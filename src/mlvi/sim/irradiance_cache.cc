// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/sim/irradiance_cache.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>

#include "mlvi/base/error.h"
#include "mlvi/sim/sky.h"

namespace mlvi {
namespace {

constexpr double kSpacing = 0.4;   // m between nodes
constexpr int kMaxDivisions = 64;  // of an edge: 26 m at full density
constexpr int kDirections = 48;
constexpr double kFar = 200.0;       // m: beyond it counts as open
constexpr double kLampRange = 25.0;  // m: farther lamps give no light worth a ray
// m: the bright spot behind a lamp is met by one direction or none; taken at its full brightness it
// would speckle the walls.
constexpr double kBounceDistance = 1.0;
constexpr double kOffTheWall = 0.003;  // m, so that rays do not meet their own surface

std::uint64_t Pack(IrradianceCache::Irradiance value) {
  // Never 0, which stands for "not yet known".
  const float sky = std::max(value.sky, 1e-20F), lamps = std::max(value.lamps, 1e-20F);
  return (std::uint64_t{std::bit_cast<std::uint32_t>(sky)} << 32) |
         std::bit_cast<std::uint32_t>(lamps);
}

IrradianceCache::Irradiance Unpack(std::uint64_t bits) {
  return {.sky = std::bit_cast<float>(static_cast<std::uint32_t>(bits >> 32)),
          .lamps = std::bit_cast<float>(static_cast<std::uint32_t>(bits))};
}

float Sum(const IrradianceCache::Irradiance& value) { return value.sky + value.lamps; }

// Whether the nodes around a point are so different that they may lie on two sides of something.
bool Disagree(const std::array<IrradianceCache::Irradiance, 3>& values) {
  constexpr float kRatio = 3.0F;
  const auto [low, high] = std::minmax({Sum(values[0]), Sum(values[1]), Sum(values[2])});
  return high > kRatio * low;
}

std::size_t NodesOf(int divisions) {
  const auto n = static_cast<std::size_t>(divisions);
  return (n + 1) * (n + 2) / 2;
}

// The cosine-weighted hemisphere around z, evenly covered (a spiral on the disc below it).
std::vector<Eigen::Vector3d> Hemisphere() {
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> result;
  for (int i = 0; i < kDirections; ++i) {
    const double r2 = (i + 0.5) / kDirections, angle = golden_angle * i;
    result.emplace_back(std::sqrt(r2) * std::cos(angle), std::sqrt(r2) * std::sin(angle),
                        std::sqrt(1.0 - r2));
  }
  return result;
}

}  // namespace

IrradianceCache::IrradianceCache(const World& world, std::vector<float> albedos)
    : world_(&world), albedos_(std::move(albedos)), directions_(Hemisphere()) {
  const TriangleMesh& mesh = world.mesh();
  MLVI_CHECK(albedos_.size() == mesh.materials.size(), "{} albedos for {} materials",
             albedos_.size(), mesh.materials.size());
  std::size_t nodes = 0;
  for (const auto& t : mesh.triangles) {
    const auto &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double edge = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int divisions =
        std::clamp(static_cast<int>(std::ceil(edge / kSpacing)), 1, kMaxDivisions);
    lattices_.push_back({.first = nodes, .divisions = divisions});
    nodes += 2 * NodesOf(divisions);
  }
  values_ = std::make_unique<std::atomic<std::uint64_t>[]>(nodes);
  FindJoinedEdges();
  FindCornerPulls();
}

void IrradianceCache::FindJoinedEdges() {
  const TriangleMesh& mesh = world_->mesh();
  // By the positions of both ends, in either order: triangles need not share vertices.
  using Ends = std::array<float, 6>;
  struct Side {
    std::uint32_t triangle = 0;
    unsigned bit = 0;
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  };
  std::map<Ends, std::vector<Side>> sides;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const std::array<Eigen::Vector3f, 3> p = {mesh.vertices[t[0]], mesh.vertices[t[1]],
                                              mesh.vertices[t[2]]};
    const Eigen::Vector3f normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    constexpr std::array<std::array<std::size_t, 2>, 3> kEdges = {{{0, 1}, {0, 2}, {1, 2}}};
    for (unsigned k = 0; k < 3; ++k) {
      const auto &a = p[kEdges[k][0]], &b = p[kEdges[k][1]];
      const std::array<float, 3> from = {a.x(), a.y(), a.z()}, to = {b.x(), b.y(), b.z()};
      const auto& [low, high] = std::minmax(from, to);
      sides[{low[0], low[1], low[2], high[0], high[1], high[2]}].push_back({i, 1U << k, normal});
    }
  }
  for (const auto& [ends, here] : sides) {
    for (const Side& one : here) {
      for (const Side& other : here) {
        if (one.triangle != other.triangle && std::abs(one.normal.dot(other.normal)) > 0.9999F)
          lattices_[one.triangle].joined |= one.bit;
      }
    }
  }
}

void IrradianceCache::FindCornerPulls() {
  const TriangleMesh& mesh = world_->mesh();
  // A corner by its position, and the plane that it belongs to by the normal of either side.
  using Key = std::array<float, 6>;
  struct Sum {
    Eigen::Vector3f value = Eigen::Vector3f::Zero();
  };
  std::map<Key, Sum> pulls;
  const auto visit = [&](const auto& action) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& t = mesh.triangles[i];
      const std::array<Eigen::Vector3f, 3> p = {mesh.vertices[t[0]], mesh.vertices[t[1]],
                                                mesh.vertices[t[2]]};
      Eigen::Vector3f plane =
          (50.0F * (p[1] - p[0]).cross(p[2] - p[0]).normalized()).array().round();
      const bool turn = std::array{plane.x(), plane.y(), plane.z()} < std::array{0.0F, 0.0F, 0.0F};
      plane = (turn ? -plane : plane) + Eigen::Vector3f::Zero();  // no -0
      const Eigen::Vector3f middle = (p[0] + p[1] + p[2]) / 3.0F;
      for (std::size_t k = 0; k < 3; ++k) {
        const Key key = {p[k].x(), p[k].y(), p[k].z(), plane.x(), plane.y(), plane.z()};
        action(pulls[key].value, i, k, (middle - p[k]).normalized());
      }
    }
  };
  corner_pulls_.resize(mesh.triangles.size());
  visit([](Eigen::Vector3f& pull, std::size_t, std::size_t, const Eigen::Vector3f& inward) {
    if (inward.allFinite()) pull += inward;
  });
  visit([&](const Eigen::Vector3f& pull, std::size_t i, std::size_t k, const Eigen::Vector3f&) {
    const float length = pull.norm();
    corner_pulls_[i][k] = length > 0.1F ? Eigen::Vector3f(pull / length) : Eigen::Vector3f::Zero();
  });
}

// Nodes on the rim of a plane are pulled 2 cm inwards, off the corners where surfaces meet; those
// on an edge within a plane only along it, so that both of its triangles keep them in common.
Eigen::Vector3d IrradianceCache::NodePoint(std::uint32_t triangle, int i, int j) const {
  const TriangleMesh& mesh = world_->mesh();
  const auto& t = mesh.triangles[triangle];
  const auto corner = [&](std::size_t k) -> Eigen::Vector3d {
    return mesh.vertices[t[k]].cast<double>();
  };
  const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
  const int n = lattices_[triangle].divisions;
  const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
  const Eigen::Vector3d point = a + u * (b - a) + v * (c - a);
  const int corner_index = i == n ? 1 : j == n ? 2 : i + j == 0 ? 0 : -1;
  if (corner_index >= 0) {
    const auto& pull = corner_pulls_[triangle][static_cast<std::size_t>(corner_index)];
    const double size = ((a + b + c) / 3.0 - point).norm();
    return point + std::min(0.02, 0.3 * size) * pull.cast<double>();
  }
  const unsigned on = (j == 0 ? 1U : 0U) | (i == 0 ? 2U : 0U) | (i + j == n ? 4U : 0U);
  const unsigned joined = on & lattices_[triangle].joined;
  if (on == joined) return point;
  Eigen::Vector3d goal = (a + b + c) / 3.0;
  if (joined == 1U) goal = 0.5 * (a + b);
  if (joined == 2U) goal = 0.5 * (a + c);
  if (joined == 4U) goal = 0.5 * (b + c);
  const Eigen::Vector3d inward = goal - point;
  return point + std::min(0.02, 0.3 * inward.norm()) * inward.normalized();
}

IrradianceCache::Irradiance IrradianceCache::At(std::uint32_t triangle,
                                                const Eigen::Vector2f& barycentric,
                                                const Eigen::Vector3d& normal) const {
  const TriangleMesh& mesh = world_->mesh();
  const auto& t = mesh.triangles[triangle];
  const Eigen::Vector3f ab = mesh.vertices[t[1]] - mesh.vertices[t[0]];
  const Eigen::Vector3f ac = mesh.vertices[t[2]] - mesh.vertices[t[0]];
  const bool front = ab.cross(ac).dot(normal.cast<float>()) > 0.0F;
  const int n = lattices_[triangle].divisions;
  const float u = std::max(0.0F, barycentric.x()) * static_cast<float>(n);
  const float v = std::max(0.0F, barycentric.y()) * static_cast<float>(n);
  int i = std::min(static_cast<int>(u), n - 1);
  int j = std::min(static_cast<int>(v), n - 1 - i);
  const float fu = std::clamp(u - static_cast<float>(i), 0.0F, 1.0F);
  const float fv = std::clamp(v - static_cast<float>(j), 0.0F, 1.0F);
  // The cell (i, j) is cut in two by its diagonal; on the hypotenuse only the lower half exists.
  const bool upper = fu + fv > 1.0F && i + j + 2 <= n;
  const std::array<Node, 3> nodes = {{{i + 1, j}, {i, j + 1}, {i + upper, j + upper}}};
  std::array<Irradiance, 3> values;
  for (std::size_t k = 0; k < 3; ++k)
    values[k] = NodeValue(triangle, nodes[k].i, nodes[k].j, front, normal);
  std::array<float, 3> weights = {upper ? 1.0F - fv : fu, upper ? 1.0F - fu : fv, 0.0F};
  weights[2] = std::max(0.0F, 1.0F - weights[0] - weights[1]);
  if (Disagree(values)) {
    const Eigen::Vector3f point = mesh.vertices[t[0]] + barycentric.x() * ab + barycentric.y() * ac;
    LeaveOutHidden(triangle, nodes, point.cast<double>(), normal, values, weights);
  }
  const float sum = weights[0] + weights[1] + weights[2];
  Irradiance result;
  for (std::size_t k = 0; k < 3; ++k) {
    result.sky += weights[k] / sum * values[k].sky;
    result.lamps += weights[k] / sum * values[k].lamps;
  }
  return result;
}

// Nodes that `point` does not see belong to another side of something that pierces the triangle or
// stands on it: a roof, a wall, a box. Where it sees none (a crevice) the darkest one counts.
void IrradianceCache::LeaveOutHidden(std::uint32_t triangle, const std::array<Node, 3>& nodes,
                                     const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                     const std::array<Irradiance, 3>& values,
                                     std::array<float, 3>& weights) const {
  const WorldSnapshot still = world_->StaticSnapshot();
  const Eigen::Vector3d from = point + kOffTheWall * normal;
  bool seen = false;
  std::size_t darkest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (Sum(values[k]) < Sum(values[darkest])) darkest = k;
    const Eigen::Vector3d way =
        NodePoint(triangle, nodes[k].i, nodes[k].j) + kOffTheWall * normal - from;
    const double distance = way.norm();
    if (distance > kOffTheWall && still.Occluded(from, way / distance, distance))
      weights[k] = 0.0F;
    else
      seen = seen || weights[k] > 1e-3F;
  }
  if (seen) return;
  weights = {};
  weights[darkest] = 1.0F;
}

IrradianceCache::Irradiance IrradianceCache::NodeValue(std::uint32_t triangle, int i, int j,
                                                       bool front,
                                                       const Eigen::Vector3d& normal) const {
  const Lattice& lattice = lattices_[triangle];
  const int n = lattice.divisions;
  // Row j of the lattice has n + 1 - j nodes.
  const auto index = lattice.first + (front ? 0 : NodesOf(n)) +
                     static_cast<std::size_t>(j * (n + 1) - j * (j - 1) / 2 + i);
  if (const std::uint64_t bits = values_[index].load(std::memory_order_relaxed); bits != 0)
    return Unpack(bits);
  const Eigen::Vector3d point = NodePoint(triangle, i, j);
  const std::uint64_t bits = Pack(Compute(point + kOffTheWall * normal, normal));
  values_[index].store(bits, std::memory_order_relaxed);
  return Unpack(bits);
}

IrradianceCache::Irradiance IrradianceCache::Compute(const Eigen::Vector3d& point,
                                                     const Eigen::Vector3d& normal) const {
  const Lighting& light = world_->lighting();
  const bool day = light.sun_illuminance > 0.0 || light.sky_illuminance > 0.0;
  const WorldSnapshot still = world_->StaticSnapshot();
  const Eigen::Vector3d across = normal.unitOrthogonal();
  Eigen::Matrix3d R;
  R << across, normal.cross(across), normal;
  double sky = 0.0, lamps = 0.0;
  for (const Eigen::Vector3d& local : directions_) {
    const Eigen::Vector3d direction = R * local;
    const auto hit = still.Cast(point, direction, kFar);
    if (!hit || hit->material->transmission > 0.5) {
      if (day) sky += SkyLuminance(light, direction);
      continue;
    }
    const Eigen::Vector3d bounce = point + hit->range * direction + kOffTheWall * hit->normal;
    const auto material = static_cast<std::size_t>(hit->material - world_->mesh().materials.data());
    const double scattered = albedos_[material] / std::numbers::pi;
    if (day) {
      const double facing = hit->normal.dot(light.sun_direction);
      if (facing > 0.0 && !still.Occluded(bounce, light.sun_direction, kFar))
        sky += scattered * facing * light.sun_illuminance;
      const Eigen::Vector3d up = (hit->normal + 0.7 * Eigen::Vector3d::UnitZ()).normalized();
      if (!still.Occluded(bounce, up, kFar)) sky += scattered * 0.7 * light.sky_illuminance;
    }
    if (!light.lamps.empty()) lamps += scattered * LampsAt(bounce, hit->normal, 2, kBounceDistance);
  }
  // Directions are weighted by the cosine: each stands for pi / N of irradiance per luminance.
  const double weight = std::numbers::pi / kDirections;
  return {.sky = static_cast<float>(weight * sky),
          .lamps = static_cast<float>(weight * lamps + LampsAt(point, normal, 8, 0.1))};
}

// Direct light of the `limit` strongest lamps, none as if nearer than `nearest` m.
double IrradianceCache::LampsAt(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                std::size_t limit, double nearest) const {
  std::vector<std::pair<double, const PointLamp*>> lit;
  for (const PointLamp& lamp : world_->lighting().lamps) {
    const Eigen::Vector3d way = lamp.position - point;
    const double distance = way.norm(), cosine = normal.dot(way) / distance;
    if (cosine <= 0.0 || distance > kLampRange) continue;
    lit.emplace_back(lamp.intensity * cosine / std::max(nearest * nearest, distance * distance),
                     &lamp);
  }
  const auto stronger = [](const auto& a, const auto& b) { return a.first > b.first; };
  std::stable_sort(lit.begin(), lit.end(), stronger);
  const WorldSnapshot still = world_->StaticSnapshot();
  double sum = 0.0;
  for (std::size_t i = 0; i < std::min(limit, lit.size()); ++i) {
    const Eigen::Vector3d way = lit[i].second->position - point;
    const double distance = way.norm();
    // The lamp's own housing, 0.15 m around it, throws no shadow.
    if (!still.Occluded(point, way / distance, std::max(0.0, distance - 0.15))) sum += lit[i].first;
  }
  return sum;
}

}  // namespace mlvi

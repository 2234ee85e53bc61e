// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/depth_association.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "mlvi/geometry/tangent_basis.h"
#include "mlvi/vio/depth_arc.h"

namespace mlvi {
namespace {

using Neighbors = SphericalDepthMap::Neighbors;

constexpr int kRounds = 6;
constexpr double kConverged = 0.1;  // cells
// Slopes that a surface may have before it is seen, one sigma: tan of the angle of incidence. Tells
// how far a plane may be trusted across a ring of the LiDAR.
constexpr double kSlopePrior = 10.0;
// Points whose scatter was known beforehand: few neighbours tell little about theirs.
constexpr double kPriorPoints = 6.0;
constexpr int kFits = 2;  // the noise of points depends on the plane

// A plane a . p = 1 around the direction s, as seen from S: with x = B^T p / (s . p) the inverse
// depth along s is linear, 1 / (s . p) = q + g . x, and a = q s + B g.
struct LocalPlane {
  Eigen::Matrix3d basis;         // [s, B]
  Eigen::Vector3d coefficients;  // [q, g]
  Eigen::Matrix3d covariance;
  // Of points about the plane, along their beams and as a share of depth: the variance that their
  // noise does not explain, which is relief, and the largest deviation.
  double relief_variance = 0.0, worst = 0.0;

  Eigen::Vector3d normal() const { return basis * coefficients; }  // a
};

// One point around s.
struct Sample {
  Eigen::Vector3d row;  // [1, x]
  double inverse_depth = 0.0;
};

Sample SampleOf(const Eigen::Vector3d& point, const Eigen::Matrix3d& basis) {
  const Eigen::Vector3d local = basis.transpose() * point;
  return {local / local[0], 1.0 / local[0]};
}

// 1 / variance of an inverse depth, given how the surface lies: errors of range and relief along
// the beam, and of the beam's direction across the slope.
double Weight(const Sample& sample, const Eigen::Vector3d& coefficients, double sine,
              const DepthConfig& config) {
  const double relief = config.roughness / sine;
  const double range = sample.inverse_depth * sample.inverse_depth *
                       std::sqrt(config.range_noise * config.range_noise + relief * relief);
  const double turned = coefficients.tail<2>().norm() * config.beam_noise;
  return 1.0 / (range * range + turned * turned);
}

double SineOf(const Eigen::Vector3d& normal, const Eigen::Vector3d& direction) {
  return std::abs(normal.normalized().dot(direction));
}

// What the points tell about the plane's own covariance and about the relief around it.
void JudgeScatter(std::span<const Sample> samples, const Eigen::Vector3d& seek,
                  const DepthConfig& config, LocalPlane& plane) {
  const double sine = std::max(SineOf(plane.normal(), seek), config.min_incidence);
  double squares = 0.0, excess = 0.0;
  for (const Sample& sample : samples) {
    const double error = sample.inverse_depth - sample.row.dot(plane.coefficients);
    const double weight = Weight(sample, plane.coefficients, sine, config);
    const double share = error / sample.inverse_depth;
    squares += error * error * weight;
    excess += share * share - 1.0 / (weight * sample.inverse_depth * sample.inverse_depth);
    plane.worst = std::max(plane.worst, std::abs(share));
  }
  const double freedom = kPriorPoints + static_cast<double>(samples.size()) - 3.0;
  plane.covariance *= std::max(1.0, (kPriorPoints + squares) / freedom);
  plane.relief_variance = std::max(0.0, excess) / freedom;
}

// Through the `count` nearest of the neighbours.
LocalPlane FitPlane(const SphericalDepthMap& map, const Neighbors& near, int count,
                    const Eigen::Vector3d& seek, const DepthConfig& config) {
  LocalPlane plane;
  plane.basis << seek, TangentBasis(seek);
  std::array<Sample, Neighbors::kCapacity> samples;
  for (int i = 0; i < count; ++i) {
    samples[i] = SampleOf(map.points()[static_cast<std::size_t>(near.index[i])], plane.basis);
  }
  plane.coefficients << samples[0].inverse_depth, 0.0, 0.0;
  for (int fit = 0; fit < kFits; ++fit) {
    const double sine = std::max(SineOf(plane.normal(), seek), config.min_incidence);
    const double slope = kSlopePrior * plane.coefficients[0];
    Eigen::Matrix3d information =
        Eigen::Vector3d(0.0, 1.0 / (slope * slope), 1.0 / (slope * slope)).asDiagonal();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (int i = 0; i < count; ++i) {
      const double weight = Weight(samples[i], plane.coefficients, sine, config);
      information += weight * samples[i].row * samples[i].row.transpose();
      gradient += weight * samples[i].inverse_depth * samples[i].row;
    }
    plane.covariance = information.inverse();
    plane.coefficients = plane.covariance * gradient;
  }
  JudgeScatter({samples.data(), static_cast<std::size_t>(count)}, seek, config, plane);
  return plane;
}

// Whether something stands before the plane within the reach of a tracker's window: a feature there
// is likely to be its edge.
bool HasForeground(const SphericalDepthMap& map, const Neighbors& near, const LocalPlane& plane,
                   const DepthConfig& config) {
  const double sine = std::max(SineOf(plane.normal(), plane.basis.col(0)), config.min_incidence);
  for (int i = 0; i < near.count && near.angle[i] < kWindowReach; ++i) {
    const Sample sample =
        SampleOf(map.points()[static_cast<std::size_t>(near.index[i])], plane.basis);
    const double nearer = sample.inverse_depth - sample.row.dot(plane.coefficients);
    const double weight = Weight(sample, plane.coefficients, sine, config);
    if (nearer > 0.0 && nearer * nearer * weight > config.max_nearer * config.max_nearer) {
      return true;
    }
  }
  return false;
}

// The share of a depth by which points may be off the plane.
double SpreadLimit(double depth, const DepthConfig& config) {
  return std::max(config.min_spread / depth, config.max_spread_ratio);
}

// From a . (C + d f) = 1: d = (1 - a . C) / (a . f), and an error of a moves it by
// -(P . da) / (a . f) where P is the meeting point. What does not average out over points: the
// relief at the feature, the error of ranges by incidence, the bearing.
FeatureDepth Intersect(const LocalPlane& plane, const Ray& ray, const DepthConfig& config) {
  const Eigen::Vector3d a = plane.normal();
  const double along = a.dot(ray.direction), sine = SineOf(a, ray.direction);
  if (!(sine > config.min_incidence)) return {.status = DepthStatus::kGrazing};
  FeatureDepth result{.depth = (1.0 - a.dot(ray.origin)) / along};
  if (!(result.depth >= config.min_depth && result.depth <= config.max_depth)) {
    return {.status = DepthStatus::kOutOfRange};
  }
  const Eigen::Vector3d by_plane = plane.basis.transpose() * ray.At(result.depth) / along;
  const double relief = config.roughness / sine;
  const double slope = result.depth * std::sqrt(1.0 - sine * sine) / sine;
  result.variance =
      by_plane.dot(plane.covariance * by_plane) + relief * relief +
      result.depth * result.depth * plane.relief_variance +
      slope * slope * (config.incidence_noise * config.incidence_noise + ray.sigma * ray.sigma);
  const double largest = config.max_relative_sigma * result.depth;
  result.status =
      result.variance > largest * largest ? DepthStatus::kUncertain : DepthStatus::kFound;
  return result;
}

// Few points on one ring of a LiDAR tell nothing across it: then a plane through all that are near.
FeatureDepth MeasureDepth(const SphericalDepthMap& map, const Neighbors& near,
                          const Eigen::Vector3d& seek, const Ray& ray, const DepthConfig& config) {
  FeatureDepth result;
  for (const int count : {std::min(near.count, config.neighbors), near.count}) {
    const LocalPlane plane = FitPlane(map, near, count, seek, config);
    if (plane.worst > SpreadLimit(1.0 / plane.coefficients[0], config)) {
      return {.status = DepthStatus::kSpread};
    }
    if (HasForeground(map, near, plane, config)) return {.status = DepthStatus::kForeground};
    result = Intersect(plane, ray, config);
    if (result.status != DepthStatus::kUncertain) break;
  }
  return result;
}

}  // namespace

FeatureDepth AssociateDepth(const SphericalDepthMap& map, const Ray& ray,
                            const DepthConfig& config) {
  const std::optional<double> first = FirstSurface(map, ray, config);
  if (!first) return {};
  const Eigen::Vector3d met = ray.At(*first).normalized();
  Eigen::Vector3d seek = met;
  for (int round = 0; round < kRounds; ++round) {
    const Neighbors near = map.Nearest(seek, Neighbors::kCapacity, config.max_neighbor_angle);
    if (near.count < 3) return {};
    const FeatureDepth result = MeasureDepth(map, near, seek, ray, config);
    if (result.status != DepthStatus::kFound) return result;
    const Eigen::Vector3d next = ray.At(result.depth).normalized();
    // The plane is that of something else than what the ray came to first.
    if ((next - met).norm() > kWindowReach) return {.status = DepthStatus::kForeground};
    const double moved = (next - seek).norm();
    seek = next;
    if (moved < kConverged * config.cell_angle) return result;
  }
  return {.status = DepthStatus::kSpread};  // no plane is that of its own surroundings
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/visual_inertial_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mlvi/geometry/sphere_minimum.h"

namespace mlvi::internal {
namespace {

constexpr int kClosedFormRounds = 5;
constexpr double kNominalDepth = 5.0;  // m, of points before the first round
constexpr double kDepthPrior = 100.0;  // m, one sigma: points that show no parallax stay finite

// A ray turned by the gyroscope into the frame of the first body; its origin is p(k) + `offset`.
struct TurnedRay {
  Eigen::Vector3d direction, offset;
  double seconds = 0.0;
  Eigen::Vector3d force_path;  // m, the part of p(k) that the IMU knows
  double sigma = 0.0;          // rad
};

std::vector<TurnedRay> TurnRays(const FeatureViews& views, const AlignmentData& data,
                                std::span<const InertialPath::Step> steps,
                                const InertialPath& path) {
  std::vector<TurnedRay> rays;
  for (const FeatureView& view : views) {
    const PanoramicObservation& o = view.observation;
    const Pose3& T_first_body = steps[view.instant].T_first_body;
    rays.push_back(
        {.direction = T_first_body.rotation() * (data.T_body_pano.rotation() * o.bearing),
         .offset = T_first_body.rotation() * (data.T_body_pano * o.center),
         .seconds = path.Elapsed(view.instant),
         .force_path = T_first_body.translation(),
         .sigma = data.pixel_sigma / o.resolution()});
  }
  return rays;
}

// Normal equations of one feature in its point X and y = [velocity, gravity]:
// the distances of X from its rays, |P (X - M y - q)| with P = I - d d^T, in sigmas.
struct PointSystem {
  Eigen::Matrix3d XX = Eigen::Matrix3d::Identity() / (kDepthPrior * kDepthPrior);
  Eigen::Matrix<double, 3, 6> Xy = Eigen::Matrix<double, 3, 6>::Zero();
  Matrix6d yy = Matrix6d::Zero();
  Eigen::Vector3d X = Eigen::Vector3d::Zero();
  Vector6d y = Vector6d::Zero();

  // `depth` of the point along the ray, m.
  void Add(const TurnedRay& ray, double depth) {
    const double weight = 1.0 / (ray.sigma * ray.sigma * depth * depth);
    const Eigen::Matrix3d P =
        weight * (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose());
    Eigen::Matrix<double, 3, 6> M;
    M << ray.seconds * Eigen::Matrix3d::Identity(),
        0.5 * ray.seconds * ray.seconds * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d q = ray.force_path + ray.offset;
    XX += P;
    Xy -= P * M;
    yy += M.transpose() * P * M;
    X += P * q;
    y -= M.transpose() * P * q;
  }
};

// y from the equations that are left once all points are eliminated.
Vector6d SolveReduced(std::span<const PointSystem> systems, double gravity) {
  Matrix6d H = Matrix6d::Zero();
  Vector6d c = Vector6d::Zero();
  for (const PointSystem& s : systems) {
    const Eigen::LLT<Eigen::Matrix3d> point(s.XX);
    H += s.yy - s.Xy.transpose() * point.solve(s.Xy);
    c += s.y - s.Xy.transpose() * point.solve(s.X);
  }
  const Eigen::LDLT<Eigen::Matrix3d> velocity(H.topLeftCorner<3, 3>());
  const Eigen::Matrix3d across = H.topRightCorner<3, 3>();
  Vector6d y;
  y.tail<3>() =
      MinimizeOnSphere(H.bottomRightCorner<3, 3>() - across.transpose() * velocity.solve(across),
                       c.tail<3>() - across.transpose() * velocity.solve(c.head<3>()), gravity);
  y.head<3>() = velocity.solve(c.head<3>() - across * y.tail<3>());
  return y;
}

Eigen::Vector3d OriginOf(const TurnedRay& ray, const Vector6d& y) {
  return ray.seconds * y.head<3>() + 0.5 * ray.seconds * ray.seconds * y.tail<3>() +
         ray.force_path + ray.offset;
}

}  // namespace

VisualInertialAlignment AlignTracks(const AlignmentData& data, const InertialPath& path,
                                    const ImuBias& bias, double gravity) {
  // Zero velocity and gravity: what is left of the path is what the IMU knows.
  const InertialUnknowns known{
      .velocity = Eigen::Vector3d::Zero(), .gravity = Eigen::Vector3d::Zero(), .bias = bias};
  const std::vector<InertialPath::Step> steps = path.Steps(known);
  std::vector<std::vector<TurnedRay>> rays;
  std::vector<std::vector<double>> depths;
  for (const FeatureViews& views : data.features) {
    rays.push_back(TurnRays(views, data, steps, path));
    depths.emplace_back(views.size(), kNominalDepth);
  }
  VisualInertialAlignment result;
  for (int round = 0; round < kClosedFormRounds; ++round) {
    std::vector<PointSystem> systems(rays.size());
    for (std::size_t f = 0; f < rays.size(); ++f) {
      for (std::size_t i = 0; i < rays[f].size(); ++i) systems[f].Add(rays[f][i], depths[f][i]);
    }
    const Vector6d y = SolveReduced(systems, gravity);
    result.unknowns = {.velocity = y.head<3>(), .gravity = y.tail<3>(), .bias = bias};
    result.inverse_depths.clear();
    for (std::size_t f = 0; f < rays.size(); ++f) {
      const Eigen::Vector3d X = systems[f].XX.llt().solve(systems[f].X - systems[f].Xy * y);
      for (std::size_t i = 0; i < rays[f].size(); ++i) {
        depths[f][i] = std::clamp((X - OriginOf(rays[f][i], y)).norm(), kNearest, kDepthPrior);
      }
      const double along = rays[f].front().direction.dot(X - OriginOf(rays[f].front(), y));
      result.inverse_depths.push_back(along > kNearest ? 1.0 / along : 1.0 / kNominalDepth);
    }
  }
  return result;
}

}  // namespace mlvi::internal

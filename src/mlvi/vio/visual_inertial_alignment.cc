// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/visual_inertial_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "mlvi/geometry/robust_kernels.h"
#include "mlvi/geometry/sphere_minimum.h"
#include "mlvi/panorama/bearing_residual.h"

namespace mlvi::internal {
namespace {

using inertial_index::kSize;

constexpr int kClosedFormRounds = 5;
constexpr double kNominalDepth = 5.0;  // m, of points before the first round
constexpr double kDepthPrior = 100.0;  // m, one sigma: points that show no parallax stay finite
constexpr double kNearest = 0.2;       // m
constexpr int kMaxIterations = 30;
constexpr double kConverged = 1e-6;  // relative decrease of the cost
constexpr CauchyKernel kKernel{2.0};

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

// Sum over residuals, and the normal equations of one feature with its inverse depth eliminated.
struct FeatureEquations {
  InertialMatrix H = InertialMatrix::Zero();
  InertialDelta b = InertialDelta::Zero();  // minus the gradient
  InertialDelta across = InertialDelta::Zero();
  double depth_H = 0.0, depth_b = 0.0;
  double cost = 0.0;
  double squared = 0.0;  // sum of whitened squares, outliers cut
  int residuals = 0, inliers = 0;
};

// The ray of an observation as it was lifted: the extrinsics are not in question here.
PanoramicRay ExactRay(const PanoramicObservation& observation) {
  PanoramicRay ray;
  ray.origin = observation.center;
  ray.direction = observation.bearing;
  ray.weight = observation.pixel_per_bearing;
  return ray;
}

class Refiner {
 public:
  Refiner(const AlignmentData& data, const ImuSpec& imu) : data_(data), imu_(imu) {}

  FeatureEquations Linearize(const FeatureViews& views, double inverse_depth,
                             std::span<const InertialPath::Step> steps) const {
    FeatureEquations e;
    const InertialPath::Step& anchor = steps[views.front().instant];
    const PanoramicRay anchor_ray = ExactRay(views.front().observation);
    for (std::size_t i = 1; i < views.size(); ++i) {
      const InertialPath::Step& target = steps[views[i].instant];
      const BearingGeometry geometry{.T_world_anchor = anchor.T_first_body,
                                     .T_world_target = target.T_first_body,
                                     .T_body_pano = data_.T_body_pano};
      BearingJacobians j;
      const auto residual =
          BearingResidual(anchor_ray, inverse_depth, ExactRay(views[i].observation), geometry, &j);
      if (!residual) continue;
      Accumulate(*residual / data_.pixel_sigma,
                 (j.anchor * anchor.d_pose + j.target * target.d_pose) / data_.pixel_sigma,
                 j.inverse_depth / data_.pixel_sigma, e);
    }
    return e;
  }

  double PriorCost(const ImuBias& bias) const {
    return 0.5 * ((bias.accelerometer / imu_.initial_accelerometer_bias_sigma).squaredNorm() +
                  (bias.gyroscope / imu_.initial_gyroscope_bias_sigma).squaredNorm());
  }

  void AddPrior(const ImuBias& bias, InertialMatrix& H, InertialDelta& b) const {
    using namespace inertial_index;
    const auto add = [&](int index, const Eigen::Vector3d& value, double sigma) {
      H.diagonal().segment<3>(index).array() += 1.0 / (sigma * sigma);
      b.segment<3>(index) -= value / (sigma * sigma);
    };
    add(kAccelerometerBias, bias.accelerometer, imu_.initial_accelerometer_bias_sigma);
    add(kGyroscopeBias, bias.gyroscope, imu_.initial_gyroscope_bias_sigma);
  }

 private:
  static void Accumulate(const Eigen::Vector2d& r, const Eigen::Matrix<double, 2, kSize>& J,
                         const Eigen::Vector2d& d_depth, FeatureEquations& e) {
    const double square = r.squaredNorm(), weight = kKernel.Weight(square);
    e.H += weight * J.transpose() * J;
    e.b -= weight * J.transpose() * r;
    e.across += weight * J.transpose() * d_depth;
    e.depth_H += weight * d_depth.squaredNorm();
    e.depth_b -= weight * d_depth.dot(r);
    e.cost += 0.5 * kKernel.Cost(square);
    e.squared += std::min(square, 18.0);  // (3 sigma)^2 on both axes
    ++e.residuals;
    if (square < 18.0) ++e.inliers;
  }

  const AlignmentData& data_;
  const ImuSpec& imu_;
};

// All features and the prior at one alignment.
struct Linearization {
  std::vector<FeatureEquations> features;
  double cost = 0.0;
};

Linearization LinearizeAll(const Refiner& refiner, const AlignmentData& data,
                           const InertialPath& path, const VisualInertialAlignment& alignment) {
  const std::vector<InertialPath::Step> steps = path.Steps(alignment.unknowns);
  Linearization result;
  result.cost = refiner.PriorCost(alignment.unknowns.bias);
  for (std::size_t f = 0; f < data.features.size(); ++f) {
    result.features.push_back(
        refiner.Linearize(data.features[f], alignment.inverse_depths[f], steps));
    result.cost += result.features.back().cost;
  }
  return result;
}

// The reduced normal equations of the unknowns.
struct ReducedSystem {
  InertialMatrix H = InertialMatrix::Zero();
  InertialDelta b = InertialDelta::Zero();
};

// A little information on each inverse depth keeps those of features without parallax in place.
constexpr double kDepthDamping = 1e-6;

ReducedSystem Reduce(const Refiner& refiner, const Linearization& linearization,
                     const InertialUnknowns& at, double lambda) {
  ReducedSystem s;
  refiner.AddPrior(at.bias, s.H, s.b);
  for (const FeatureEquations& e : linearization.features) {
    const double depth_H = e.depth_H * (1.0 + lambda) + kDepthDamping;
    s.H += e.H - e.across * e.across.transpose() / depth_H;
    s.b += e.b - e.across * (e.depth_b / depth_H);
  }
  return s;
}

VisualInertialAlignment StepFrom(const Refiner& refiner, const Linearization& linearization,
                                 const VisualInertialAlignment& from, double lambda) {
  ReducedSystem s = Reduce(refiner, linearization, from.unknowns, lambda);
  s.H.diagonal() *= 1.0 + lambda;
  const InertialDelta delta = s.H.ldlt().solve(s.b);
  VisualInertialAlignment moved;
  moved.unknowns = BoxPlus(from.unknowns, delta);
  for (std::size_t f = 0; f < linearization.features.size(); ++f) {
    const FeatureEquations& e = linearization.features[f];
    const double step =
        (e.depth_b - e.across.dot(delta)) / (e.depth_H * (1.0 + lambda) + kDepthDamping);
    moved.inverse_depths.push_back(std::clamp(from.inverse_depths[f] + step, 0.0, 1.0 / kNearest));
  }
  return moved;
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

RefinedAlignment RefineAlignment(const AlignmentData& data, const InertialPath& path,
                                 const VisualInertialAlignment& initial, const ImuSpec& imu) {
  const Refiner refiner(data, imu);
  RefinedAlignment result;
  result.alignment = initial;
  Linearization current = LinearizeAll(refiner, data, path, initial);
  double lambda = 1e-4;
  while (result.iterations < kMaxIterations && !result.converged && lambda < 1e10) {
    ++result.iterations;
    const VisualInertialAlignment trial = StepFrom(refiner, current, result.alignment, lambda);
    Linearization next = LinearizeAll(refiner, data, path, trial);
    if (!(next.cost < current.cost)) {
      lambda *= 10.0;
      continue;
    }
    result.converged = current.cost - next.cost < kConverged * current.cost;
    result.alignment = trial;
    current = std::move(next);
    lambda = std::max(lambda / 10.0, 1e-9);
  }
  int residuals = 0, inliers = 0;
  double squared = 0.0;
  for (const FeatureEquations& e : current.features) {
    residuals += e.residuals;
    inliers += e.inliers;
    squared += e.squared;
  }
  if (residuals > 0) {
    result.rms = std::sqrt(squared / (2.0 * residuals));
    result.inlier_share = static_cast<double>(inliers) / residuals;
  }
  result.covariance = Reduce(refiner, current, result.alignment.unknowns, 0.0)
                          .H.ldlt()
                          .solve(InertialMatrix::Identity());
  return result;
}

}  // namespace mlvi::internal

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mlvi/geometry/robust_kernels.h"
#include "mlvi/panorama/bearing_residual.h"
#include "mlvi/vio/visual_inertial_alignment.h"

namespace mlvi::internal {
namespace {

using inertial_index::kSize;

constexpr int kMaxIterations = 30;
constexpr double kConverged = 1e-6;  // relative decrease of the cost
constexpr CauchyKernel kKernel{2.0};
constexpr double kCut = 18.0;  // (3 sigma)^2 on both axes: squares of outliers in the rms
// A little information on each inverse depth keeps those of features without parallax in place.
constexpr double kDepthDamping = 1e-6;
// s: instants nearer to one where disturbances are estimated share those, carried on by the IMU. The
// images of one set hardly differ in them, however many cameras there are.
constexpr double kNodeInterval = 0.06;
// m, m/s, rad per interval: keeps the disturbances by an IMU without noise regular.
constexpr double kLeastDisturbance = 1e-7;

// Where disturbances are estimated: nodes, the first of which is the first instant and undisturbed,
// and the last the last.
struct DisturbanceNodes {
  explicit DisturbanceNodes(const InertialPath& path) {
    InertialPath::Disturbing since{.transition = DisturbanceMatrix::Identity(),
                                   .covariance = DisturbanceMatrix::Zero()};
    double last = 0.0;
    for (std::size_t k = 1; k < path.size(); ++k) {
      const InertialPath::Disturbing& step = path.DisturbingBefore(k);
      since.covariance =
          step.transition * since.covariance * step.transition.transpose() + step.covariance;
      since.transition = step.transition * since.transition;
      if (path.Elapsed(k) - last >= kNodeInterval || k + 1 == path.size()) {
        steps.push_back(since);
        since = {};
        last = path.Elapsed(k);
      }
      node_of.push_back(steps.size());
      carry.push_back(since.transition);
    }
  }

  std::size_t size() const { return steps.size() + 1; }

  std::vector<InertialPath::Disturbing> steps;  // to the second node, to the third, ...
  std::vector<std::size_t> node_of = {0};       // by instant: the node at or before it
  std::vector<DisturbanceMatrix> carry = {      // from the disturbance there to that of the instant
      DisturbanceMatrix::Identity()};
};

// The normal equations in the unknowns, followed by the disturbances of the second, third, ...
// node, and in the inverse depths of all features.
struct Linearization {
  Eigen::MatrixXd H;       // lower triangle
  Eigen::VectorXd b;       // minus the gradient
  Eigen::MatrixXd across;  // one column per feature
  Eigen::VectorXd depth_H, depth_b;
  double cost = 0.0;
  double squared = 0.0;  // sum of whitened squares, outliers cut
  int residuals = 0, inliers = 0;
};

// A whitened residual of feature `feature`, with its derivatives.
struct Residual {
  Eigen::Vector2d value;
  std::size_t feature, anchor, target;  // nodes, anchor <= target
  Eigen::Matrix<double, 2, kSize> d_unknowns;
  Eigen::Matrix<double, 2, kDisturbanceSize> d_anchor, d_target;  // by their disturbances
  Eigen::Vector2d d_depth;
};

// The ray of an observation as it was lifted: the extrinsics are not in question here.
PanoramicRay ExactRay(const PanoramicObservation& observation) {
  PanoramicRay ray;
  ray.origin = observation.center;
  ray.direction = observation.bearing;
  ray.weight = observation.pixel_per_bearing;
  return ray;
}

// First column of the disturbance of a node but the first.
Eigen::Index ColumnOf(std::size_t node) {
  return kSize + kDisturbanceSize * (static_cast<Eigen::Index>(node) - 1);
}

class Refiner {
 public:
  Refiner(const AlignmentData& data, const InertialPath& path, const ImuSpec& imu)
      : data_(data), path_(path), nodes_(path), imu_(imu) {}

  const DisturbanceNodes& nodes() const { return nodes_; }

  Linearization Linearize(const VisualInertialAlignment& at) const {
    const Eigen::Index size = ColumnOf(nodes_.size()),
                       features = static_cast<Eigen::Index>(data_.features.size());
    Linearization l{.H = Eigen::MatrixXd::Zero(size, size),
                    .b = Eigen::VectorXd::Zero(size),
                    .across = Eigen::MatrixXd::Zero(size, features),
                    .depth_H = Eigen::VectorXd::Zero(features),
                    .depth_b = Eigen::VectorXd::Zero(features)};
    AddBiases(at.unknowns.bias, l);
    std::vector<Disturbance> of_nodes;
    for (std::size_t k = 0; k < path_.size(); ++k) {
      if (nodes_.node_of[k] == of_nodes.size()) of_nodes.push_back(at.disturbances[k]);
    }
    for (std::size_t node = 1; node < nodes_.size(); ++node) AddDisturbing(node, of_nodes, l);
    const std::vector<InertialPath::Step> steps = path_.Steps(at.unknowns, at.disturbances);
    for (std::size_t f = 0; f < data_.features.size(); ++f) {
      AddFeature(f, at.inverse_depths[f], steps, l);
    }
    return l;
  }

 private:
  void AddBiases(const ImuBias& bias, Linearization& l) const {
    using namespace inertial_index;
    const auto add = [&](int index, const Eigen::Vector3d& value, double sigma) {
      const double information = 1.0 / (sigma * sigma);
      l.H.diagonal().segment<3>(index).array() += information;
      l.b.segment<3>(index) -= information * value;
      l.cost += 0.5 * information * value.squaredNorm();
    };
    add(kAccelerometerBias, bias.accelerometer, imu_.initial_accelerometer_bias_sigma);
    add(kGyroscopeBias, bias.gyroscope, imu_.initial_gyroscope_bias_sigma);
  }

  // How the disturbance of a node follows from that of the one before.
  void AddDisturbing(std::size_t node, const std::vector<Disturbance>& disturbances,
                     Linearization& l) const {
    const InertialPath::Disturbing& step = nodes_.steps[node - 1];
    DisturbanceMatrix covariance = step.covariance;
    covariance.diagonal().array() += kLeastDisturbance * kLeastDisturbance;
    const DisturbanceMatrix information =
        covariance.llt().solve(DisturbanceMatrix(DisturbanceMatrix::Identity()));
    const Disturbance error = disturbances[node] - step.transition * disturbances[node - 1];
    const Eigen::Index now = ColumnOf(node);
    constexpr int n = kDisturbanceSize;
    l.H.block<n, n>(now, now) += information;
    l.b.segment<n>(now) -= information * error;
    l.cost += 0.5 * error.dot(information * error);
    if (node == 1) return;
    const Eigen::Index before = ColumnOf(node - 1);
    const DisturbanceMatrix back = information * step.transition;
    l.H.block<n, n>(now, before) -= back;
    l.H.block<n, n>(before, before) += step.transition.transpose() * back;
    l.b.segment<n>(before) += back.transpose() * error;
  }

  void AddFeature(std::size_t f, double inverse_depth, std::span<const InertialPath::Step> steps,
                  Linearization& l) const {
    const FeatureViews& views = data_.features[f];
    const std::size_t first = views.front().instant;
    const InertialPath::Step& anchor = steps[first];
    const PanoramicRay anchor_ray = ExactRay(views.front().observation);
    for (std::size_t i = 1; i < views.size(); ++i) {
      const std::size_t instant = views[i].instant;
      const InertialPath::Step& target = steps[instant];
      const BearingGeometry geometry{.T_world_anchor = anchor.T_first_body,
                                     .T_world_target = target.T_first_body,
                                     .T_body_pano = data_.T_body_pano};
      BearingJacobians j;
      const auto residual =
          BearingResidual(anchor_ray, inverse_depth, ExactRay(views[i].observation), geometry, &j);
      if (!residual) continue;
      const double scale = 1.0 / data_.pixel_sigma;
      AddResidual({.value = scale * *residual,
                   .feature = f,
                   .anchor = nodes_.node_of[first],
                   .target = nodes_.node_of[instant],
                   .d_unknowns = scale * (j.anchor * anchor.d_pose + j.target * target.d_pose),
                   .d_anchor = scale * j.anchor * anchor.d_disturbance * nodes_.carry[first],
                   .d_target = scale * j.target * target.d_disturbance * nodes_.carry[instant],
                   .d_depth = scale * j.inverse_depth},
                  l);
    }
  }

  static void AddResidual(const Residual& r, Linearization& l) {
    const double square = r.value.squaredNorm(), weight = kKernel.Weight(square);
    const Eigen::Index feature = static_cast<Eigen::Index>(r.feature);
    const auto add = [&]<int n>(Eigen::Index at, const Eigen::Matrix<double, 2, n>& J) {
      const Eigen::Matrix<double, n, 2> weighted = weight * J.transpose();
      l.H.block<n, n>(at, at) += weighted * J;
      l.b.segment<n>(at) -= weighted * r.value;
      l.across.col(feature).segment<n>(at) += weighted * r.d_depth;
    };
    const auto add_between = [&]<int n, int m>(
                                 Eigen::Index row, const Eigen::Matrix<double, 2, n>& J,
                                 Eigen::Index column, const Eigen::Matrix<double, 2, m>& K) {
      l.H.block<n, m>(row, column) += (weight * J.transpose()) * K;
    };
    add(0, r.d_unknowns);
    const bool same = r.anchor == r.target;
    const Eigen::Matrix<double, 2, kDisturbanceSize> d_target =
        same ? (r.d_target + r.d_anchor).eval() : r.d_target;
    if (r.target > 0) {
      add(ColumnOf(r.target), d_target);
      add_between(ColumnOf(r.target), d_target, 0, r.d_unknowns);
    }
    if (r.anchor > 0 && !same) {
      add(ColumnOf(r.anchor), r.d_anchor);
      add_between(ColumnOf(r.anchor), r.d_anchor, 0, r.d_unknowns);
      add_between(ColumnOf(r.target), d_target, ColumnOf(r.anchor), r.d_anchor);
    }
    l.depth_H[feature] += weight * r.d_depth.squaredNorm();
    l.depth_b[feature] -= weight * r.d_depth.dot(r.value);
    l.cost += 0.5 * kKernel.Cost(square);
    l.squared += std::min(square, kCut);
    ++l.residuals;
    if (square < kCut) ++l.inliers;
  }

  const AlignmentData& data_;
  const InertialPath& path_;
  DisturbanceNodes nodes_;
  const ImuSpec& imu_;
};

Eigen::VectorXd DampedDepths(const Linearization& l, double lambda) {
  return ((1.0 + lambda) * l.depth_H).array() + kDepthDamping;
}

// The normal equations that are left once the inverse depths are eliminated.
struct ReducedSystem {
  Eigen::MatrixXd H;  // lower triangle
  Eigen::VectorXd b;
};

ReducedSystem Reduce(const Linearization& l, double lambda) {
  const Eigen::VectorXd depth_H = DampedDepths(l, lambda);
  ReducedSystem s{.H = l.H, .b = l.b - l.across * l.depth_b.cwiseQuotient(depth_H)};
  s.H.selfadjointView<Eigen::Lower>().rankUpdate(
      l.across * depth_H.cwiseSqrt().cwiseInverse().asDiagonal(), -1.0);
  return s;
}

VisualInertialAlignment StepFrom(const Linearization& l, const DisturbanceNodes& nodes,
                                 const VisualInertialAlignment& from, double lambda) {
  ReducedSystem s = Reduce(l, lambda);
  s.H.diagonal() *= 1.0 + lambda;
  const Eigen::VectorXd delta = s.H.selfadjointView<Eigen::Lower>().ldlt().solve(s.b);
  const Eigen::VectorXd depth_delta =
      (l.depth_b - l.across.transpose() * delta).cwiseQuotient(DampedDepths(l, lambda));
  VisualInertialAlignment moved = from;
  moved.unknowns = BoxPlus(from.unknowns, delta.head<kSize>());
  for (std::size_t k = 1; k < from.disturbances.size(); ++k) {
    const std::size_t node = nodes.node_of[k];
    if (node == 0) continue;
    moved.disturbances[k] += nodes.carry[k] * delta.segment<kDisturbanceSize>(ColumnOf(node));
  }
  for (std::size_t f = 0; f < from.inverse_depths.size(); ++f) {
    moved.inverse_depths[f] = std::clamp(
        from.inverse_depths[f] + depth_delta[static_cast<Eigen::Index>(f)], 0.0, 1.0 / kNearest);
  }
  return moved;
}

// Of the unknowns and the last disturbance.
AlignmentMatrix MarginalCovariance(const Linearization& l) {
  const ReducedSystem s = Reduce(l, 0.0);
  Eigen::MatrixXd chosen = Eigen::MatrixXd::Zero(s.H.rows(), AlignmentMatrix::ColsAtCompileTime);
  chosen.topLeftCorner<kSize, kSize>().setIdentity();
  chosen.bottomRightCorner<kDisturbanceSize, kDisturbanceSize>().setIdentity();
  return chosen.transpose() * s.H.selfadjointView<Eigen::Lower>().ldlt().solve(chosen);
}

}  // namespace

RefinedAlignment RefineAlignment(const AlignmentData& data, const InertialPath& path,
                                 const VisualInertialAlignment& initial, const ImuSpec& imu) {
  const Refiner refiner(data, path, imu);
  RefinedAlignment result;
  result.alignment = initial;
  result.alignment.disturbances.resize(path.size(), Disturbance::Zero());
  Linearization current = refiner.Linearize(result.alignment);
  double lambda = 1e-4;
  while (result.iterations < kMaxIterations && !result.converged && lambda < 1e10) {
    ++result.iterations;
    VisualInertialAlignment trial = StepFrom(current, refiner.nodes(), result.alignment, lambda);
    Linearization next = refiner.Linearize(trial);
    if (!(next.cost < current.cost)) {
      lambda *= 10.0;
      continue;
    }
    result.converged = current.cost - next.cost < kConverged * current.cost;
    result.alignment = std::move(trial);
    current = std::move(next);
    lambda = std::max(lambda / 10.0, 1e-9);
  }
  if (current.residuals > 0) {
    result.rms = std::sqrt(current.squared / (2.0 * current.residuals));
    result.inlier_share = static_cast<double>(current.inliers) / current.residuals;
  }
  result.covariance = MarginalCovariance(current);
  return result;
}

}  // namespace mlvi::internal

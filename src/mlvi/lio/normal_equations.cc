// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/normal_equations.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "mlvi/base/parallel.h"
#include "mlvi/geometry/robust_kernels.h"

namespace mlvi {
namespace {

constexpr std::size_t kGrain = 512;

Vector6d Row(const Correspondence& c, const Eigen::Matrix3d& R_body_world) {
  Vector6d h;
  h << c.normal, c.point.cross(R_body_world * c.normal);
  return h;
}

// The information that a noisy normal feigns: dh/dn = [I; Hat(p) R^T].
Matrix6d FeignedInformation(const Correspondence& c, const Eigen::Matrix3d& R_body_world,
                            double weight) {
  Eigen::Matrix<double, 6, 2> G;
  G << c.tilt_a, c.tilt_b, c.point.cross(R_body_world * c.tilt_a),
      c.point.cross(R_body_world * c.tilt_b);
  return weight * G * G.transpose();
}

}  // namespace

PoseNormalEquations Linearize(const std::vector<Correspondence>& correspondences,
                              const Pose3& T_world_body, const RegistrationConfig& config) {
  const Eigen::Matrix3d R = T_world_body.R();
  const Eigen::Matrix3d R_body_world = R.transpose();
  const double inflation = config.noise_inflation * config.noise_inflation;
  const CauchyKernel kernel{config.robust_width};
  const auto sum_up = [&](std::size_t begin, std::size_t end) {
    PoseNormalEquations sum;
    for (std::size_t i = begin; i < end; ++i) {
      const Correspondence& c = correspondences[i];
      const double z = c.normal.dot(R * c.point + T_world_body.translation() - c.anchor);
      const double robust = kernel.Weight(z * z / (c.variance + c.gate));
      const Vector6d h = Row(c, R_body_world);
      const double w = robust / (c.variance * inflation);
      sum.parts[PartOfSweep(c.lag)].noalias() += (w * h) * h.transpose();
      sum.b += (w * z) * h;
      sum.feigned += FeignedInformation(c, R_body_world, w);
      sum.weighted_squares += robust * z * z;
      sum.weights += robust;
      sum.chi_square += robust * z * z / c.variance;
      sum.inliers += robust > 0.5 ? 1 : 0;
    }
    for (const Matrix6d& part : sum.parts) sum.A += part;
    return sum;
  };
  return ParallelReduce(
      correspondences.size(), kGrain, PoseNormalEquations{}, sum_up,
      [](PoseNormalEquations& sum, const PoseNormalEquations& part) { sum += part; });
}

double NoiseScale(const std::vector<Correspondence>& correspondences, const Pose3& T_world_body) {
  constexpr double kMedianOfNormal = 0.674490;  // of |x|, x standard normal
  if (correspondences.empty()) return 1.0;
  std::vector<double> squares(correspondences.size());  // in sigmas
  std::transform(correspondences.begin(), correspondences.end(), squares.begin(),
                 [&](const Correspondence& c) {
                   const double z = c.normal.dot(T_world_body * c.point - c.anchor);
                   return z * z / c.variance;
                 });
  const auto median = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), median, squares.end());
  return std::sqrt(*median) / kMedianOfNormal;
}

void AddCommonError(const Matrix6d& D, Matrix6d& A, Vector6d& b) {
  const Eigen::PartialPivLU<Matrix6d> shrink(Matrix6d::Identity() + A * D);
  A = shrink.solve(A).eval();
  A = (0.5 * (A + A.transpose())).eval();
  b = shrink.solve(b).eval();
}

PoseNormalEquations& PoseNormalEquations::operator+=(const PoseNormalEquations& other) {
  A += other.A;
  for (std::size_t k = 0; k < parts.size(); ++k) parts[k] += other.parts[k];
  b += other.b;
  feigned += other.feigned;
  weighted_squares += other.weighted_squares;
  weights += other.weights;
  chi_square += other.chi_square;
  inliers += other.inliers;
  return *this;
}

}  // namespace mlvi

// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/vio/inertial_path.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "mlvi/base/error.h"
#include "mlvi/geometry/so3.h"
#include "mlvi/geometry/tangent_basis.h"

namespace mlvi {

Eigen::Matrix<double, 3, 2> GravityTangent(const Eigen::Vector3d& gravity) {
  return gravity.norm() * TangentBasis(gravity.normalized());
}

InertialUnknowns BoxPlus(const InertialUnknowns& unknowns, const InertialDelta& delta) {
  using namespace inertial_index;
  InertialUnknowns moved = unknowns;
  moved.velocity += delta.segment<3>(kVelocity);
  moved.gravity = unknowns.gravity.norm() *
                  (unknowns.gravity + GravityTangent(unknowns.gravity) * delta.segment<2>(kGravity))
                      .normalized();
  moved.bias.accelerometer += delta.segment<3>(kAccelerometerBias);
  moved.bias.gyroscope += delta.segment<3>(kGyroscopeBias);
  return moved;
}

InertialPath::InertialPath(std::span<const Time> instants, std::span<const ImuSample> samples,
                           const ImuBias& bias, const ImuSpec& imu) {
  MLVI_CHECK(!instants.empty() && !samples.empty(), "a path needs instants and IMU samples");
  for (std::size_t k = 1; k < instants.size(); ++k) {
    MLVI_CHECK(instants[k - 1] < instants[k], "instants must be in strictly ascending order");
    motions_.push_back(
        Preintegrate(SamplesBetween(samples, instants.front(), instants[k]), bias, imu));
  }
}

InertialPath::Step InertialPath::At(std::size_t k, const InertialUnknowns& unknowns) const {
  using namespace inertial_index;
  Step step;
  step.velocity = unknowns.velocity;
  step.d_velocity.middleCols<3>(kVelocity).setIdentity();
  if (k == 0) return step;
  const PreintegratedImu& motion = motions_[k - 1];
  const PreintegratedImu corrected = CorrectedForBias(motion, unknowns.bias);
  const double t = motion.dt();
  step.velocity += t * unknowns.gravity + corrected.delta_v;
  step.T_first_body =
      Pose3(corrected.delta_R,
            t * unknowns.velocity + 0.5 * t * t * unknowns.gravity + corrected.delta_p);
  const Eigen::Matrix3d Rt = corrected.delta_R.toRotationMatrix().transpose();
  const Eigen::Matrix<double, 3, 2> d_gravity = GravityTangent(unknowns.gravity);
  step.d_velocity.middleCols<2>(kGravity) = t * d_gravity;
  step.d_velocity.middleCols<3>(kAccelerometerBias) = motion.dv_dba;
  step.d_velocity.middleCols<3>(kGyroscopeBias) = motion.dv_dbg;
  step.d_pose.block<3, 3>(0, kVelocity) = t * Rt;
  step.d_pose.block<3, 2>(0, kGravity) = 0.5 * t * t * Rt * d_gravity;
  step.d_pose.block<3, 3>(0, kAccelerometerBias) = Rt * motion.dp_dba;
  step.d_pose.block<3, 3>(0, kGyroscopeBias) = Rt * motion.dp_dbg;
  // delta_R(b) = delta_R Exp(J (b - b0)): the perturbation of b sits within the exponential.
  const Eigen::Vector3d turned = motion.dR_dbg * (unknowns.bias.gyroscope - motion.bias.gyroscope);
  step.d_pose.block<3, 3>(3, kGyroscopeBias) = RightJacobianSo3(turned) * motion.dR_dbg;
  return step;
}

std::vector<InertialPath::Step> InertialPath::Steps(const InertialUnknowns& unknowns) const {
  std::vector<Step> steps;
  for (std::size_t k = 0; k < size(); ++k) steps.push_back(At(k, unknowns));
  return steps;
}

InertialPath::Excitation InertialPath::FindExcitation(const ImuNoise& noise, double gravity) const {
  const Eigen::Index count = static_cast<Eigen::Index>(motions_.size());
  if (count < 3) return {};
  Eigen::MatrixXd explained(count, 2), positions(count, 3), covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double t = motions_[static_cast<std::size_t>(i)].dt();
    explained.row(i) << t, t * t;
    positions.row(i) = motions_[static_cast<std::size_t>(i)].delta_p.transpose();
    for (Eigen::Index j = 0; j <= i; ++j) {
      // Covariance of white noise integrated twice, and three times, at s <= t.
      const double s = motions_[static_cast<std::size_t>(j)].dt();
      const double twice = s * s * (3.0 * t - s) / 6.0;
      const double thrice = s * s * s * (10.0 * t * t - 5.0 * t * s + s * s) / 120.0;
      covariance(i, j) = covariance(j, i) = std::pow(noise.accelerometer_density, 2) * twice +
                                            std::pow(gravity * noise.gyroscope_density, 2) * thrice;
    }
  }
  const Eigen::MatrixXd left =
      Eigen::MatrixXd::Identity(count, count) -
      explained * (explained.transpose() * explained).ldlt().solve(explained.transpose());
  const double instants = static_cast<double>(count);
  return {.path = std::sqrt((left * positions).squaredNorm() / instants),
          .noise = std::sqrt(3.0 * (left * covariance * left.transpose()).trace() / instants)};
}

}  // namespace mlvi

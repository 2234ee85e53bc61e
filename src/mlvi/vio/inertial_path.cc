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

namespace {

// On the way from one instant to the next, `motion`, whose first is turned by `R_first_from`
// against the first of all.
InertialPath::Disturbing DisturbingOn(const PreintegratedImu& motion,
                                      const Eigen::Matrix3d& R_first_from) {
  using namespace nav_index;
  InertialPath::Disturbing result;
  DisturbanceMatrix& transition = result.transition;
  transition.block<3, 3>(kPosition, kVelocity) = motion.dt() * Eigen::Matrix3d::Identity();
  transition.block<3, 3>(kPosition, kRotation) = -R_first_from * Hat(motion.delta_p);
  transition.block<3, 3>(kVelocity, kRotation) = -R_first_from * Hat(motion.delta_v);
  transition.block<3, 3>(kRotation, kRotation) = motion.delta_R.toRotationMatrix().transpose();
  DisturbanceMatrix to_first = DisturbanceMatrix::Identity();
  to_first.block<3, 3>(kPosition, kPosition) = R_first_from;
  to_first.block<3, 3>(kVelocity, kVelocity) = R_first_from;
  result.covariance = to_first *
                      motion.covariance.topLeftCorner<kDisturbanceSize, kDisturbanceSize>() *
                      to_first.transpose();
  return result;
}

}  // namespace

InertialPath::InertialPath(std::span<const Time> instants, std::span<const ImuSample> samples,
                           const ImuBias& bias, const ImuSpec& imu) {
  MLVI_CHECK(!instants.empty() && !samples.empty(), "a path needs instants and IMU samples");
  Eigen::Matrix3d R_first = Eigen::Matrix3d::Identity();  // of the body at the instant before
  for (std::size_t k = 1; k < instants.size(); ++k) {
    MLVI_CHECK(instants[k - 1] < instants[k], "instants must be in strictly ascending order");
    motions_.push_back(
        Preintegrate(SamplesBetween(samples, instants.front(), instants[k]), bias, imu));
    disturbing_.push_back(DisturbingOn(
        Preintegrate(SamplesBetween(samples, instants[k - 1], instants[k]), bias, imu), R_first));
    R_first = motions_.back().delta_R.toRotationMatrix();
  }
}

InertialPath::Step InertialPath::At(std::size_t k, const InertialUnknowns& unknowns,
                                    const Disturbance& disturbance) const {
  using namespace inertial_index;
  Step step;
  step.velocity = unknowns.velocity;
  step.d_velocity.middleCols<3>(kVelocity).setIdentity();
  if (k == 0) return step;
  const PreintegratedImu& motion = motions_[k - 1];
  const PreintegratedImu corrected = CorrectedForBias(motion, unknowns.bias);
  const double t = motion.dt();
  const Eigen::Vector3d off = disturbance.segment<3>(nav_index::kRotation);
  step.velocity +=
      t * unknowns.gravity + corrected.delta_v + disturbance.segment<3>(nav_index::kVelocity);
  step.T_first_body = Pose3(corrected.delta_R * ExpSo3(off),
                            t * unknowns.velocity + 0.5 * t * t * unknowns.gravity +
                                corrected.delta_p + disturbance.segment<3>(nav_index::kPosition));
  const Eigen::Matrix3d Rt = step.T_first_body.R().transpose();
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
  step.d_pose.block<3, 3>(3, kGyroscopeBias) =
      ExpSo3(off).toRotationMatrix().transpose() * RightJacobianSo3(turned) * motion.dR_dbg;
  step.d_disturbance.block<3, 3>(0, nav_index::kPosition) = Rt;
  step.d_disturbance.block<3, 3>(3, nav_index::kRotation) = RightJacobianSo3(off);
  return step;
}

std::vector<InertialPath::Step> InertialPath::Steps(
    const InertialUnknowns& unknowns, std::span<const Disturbance> disturbances) const {
  MLVI_CHECK(disturbances.empty() || disturbances.size() == size(),
             "{} disturbances for {} instants", disturbances.size(), size());
  std::vector<Step> steps;
  for (std::size_t k = 0; k < size(); ++k) {
    steps.push_back(
        At(k, unknowns, disturbances.empty() ? Disturbance(Disturbance::Zero()) : disturbances[k]));
  }
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

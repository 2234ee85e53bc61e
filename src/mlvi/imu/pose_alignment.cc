// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/imu/pose_alignment.h"

#include <Eigen/Cholesky>

#include "mlvi/geometry/so3.h"
#include "mlvi/geometry/sphere_minimum.h"

namespace mlvi::internal {
namespace {

using nav_index::kPosition;
using nav_index::kRotation;
using nav_index::kVelocity;

Eigen::Matrix3d Block(const Matrix15d& m, int index) { return m.block<3, 3>(index, index); }

// Rows of one interval in the unknowns [gravity | v_first, v_second, accelerometer bias] and their
// right side, whitened.
struct IntervalRows {
  Eigen::Matrix<double, 6, 12> A;
  Eigen::Matrix<double, 6, 1> b;
};

//   delta_p + dp_dba ba = R^T (p' - p - v dt - g dt^2 / 2),   delta_v + dv_dba ba = R^T (v' - v - g
//   dt).
IntervalRows RowsOf(const TimedPose& from, const TimedPose& to, const PreintegratedImu& motion,
                    double gravity) {
  const double dt = motion.dt();
  const Eigen::Matrix3d Rt = from.T_start_body.R().transpose();
  IntervalRows rows;
  rows.A.setZero();
  rows.A.topRows<3>() << -0.5 * dt * dt * Rt, -dt * Rt, Eigen::Matrix3d::Zero(), -motion.dp_dba;
  rows.A.bottomRows<3>() << -dt * Rt, -Rt, Rt, -motion.dv_dba;
  rows.b << motion.delta_p - Rt * (to.T_start_body.translation() - from.T_start_body.translation()),
      motion.delta_v;
  // An error of the poses' rotation turns gravity and so passes for acceleration.
  const Matrix6d& step = to.covariance;
  const double tilt_variance = step.bottomRightCorner<3, 3>().trace() / 3.0 * gravity * gravity;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d position_covariance = Block(motion.covariance, kPosition) +
                                              step.topLeftCorner<3, 3>() +
                                              0.25 * std::pow(dt, 4) * tilt_variance * identity;
  const Eigen::Matrix3d velocity_covariance =
      Block(motion.covariance, kVelocity) + dt * dt * tilt_variance * identity;
  const Eigen::LLT<Eigen::Matrix3d> p(position_covariance), v(velocity_covariance);
  rows.A.topRows<3>() = p.matrixL().solve(rows.A.topRows<3>().eval());
  rows.b.head<3>() = p.matrixL().solve(rows.b.head<3>().eval());
  rows.A.bottomRows<3>() = v.matrixL().solve(rows.A.bottomRows<3>().eval());
  rows.b.tail<3>() = v.matrixL().solve(rows.b.tail<3>().eval());
  return rows;
}

// Columns of the interval's unknowns among all: gravity, velocities, accelerometer bias.
std::vector<int> Columns(std::size_t interval, std::size_t poses) {
  std::vector<int> columns;
  for (const std::size_t block : {std::size_t{0}, 1 + interval, 2 + interval, 1 + poses}) {
    for (int i = 0; i < 3; ++i) columns.push_back(static_cast<int>(3 * block) + i);
  }
  return columns;
}

}  // namespace

Eigen::Vector3d AlignGyroscopeBias(std::span<const TimedPose> poses,
                                   std::span<const PreintegratedImu> motions, const ImuSpec& imu) {
  const double sigma = imu.initial_gyroscope_bias_sigma;
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity() / (sigma * sigma);
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Eigen::Quaterniond turn =
        poses[k].T_start_body.rotation().conjugate() * poses[k + 1].T_start_body.rotation();
    const Eigen::Matrix3d weight = (Block(motions[k].covariance, kRotation) +
                                    poses[k + 1].covariance.bottomRightCorner<3, 3>())
                                       .inverse();
    const Eigen::Matrix3d Jt_weight = motions[k].dR_dbg.transpose() * weight;
    H += Jt_weight * motions[k].dR_dbg;
    c += Jt_weight * LogSo3(motions[k].delta_R.conjugate() * turn);
  }
  return motions.front().bias.gyroscope + H.ldlt().solve(c);
}

PoseAlignment AlignGravity(std::span<const TimedPose> poses,
                           std::span<const PreintegratedImu> motions, const ImuSpec& imu,
                           double gravity) {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(poses.size()) + 6;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd c = Eigen::VectorXd::Zero(size);
  const double sigma = imu.initial_accelerometer_bias_sigma;
  H.diagonal().tail<3>().setConstant(1.0 / (sigma * sigma));
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const IntervalRows rows = RowsOf(poses[k], poses[k + 1], motions[k], gravity);
    const std::vector<int> columns = Columns(k, poses.size());
    H(columns, columns) += rows.A.transpose() * rows.A;
    c(columns) += rows.A.transpose() * rows.b;
  }
  // Eliminate all but gravity, which then has a closed form on its sphere.
  const Eigen::Index rest = size - 3;
  const Eigen::LDLT<Eigen::MatrixXd> rest_ldlt(H.bottomRightCorner(rest, rest));
  const Eigen::MatrixXd H_rest_gravity = H.bottomLeftCorner(rest, 3);
  const Eigen::Matrix3d H_gravity =
      H.topLeftCorner<3, 3>() - H_rest_gravity.transpose() * rest_ldlt.solve(H_rest_gravity);
  const Eigen::Vector3d c_gravity =
      c.head<3>() - H_rest_gravity.transpose() * rest_ldlt.solve(c.tail(rest));
  PoseAlignment result;
  result.gravity = MinimizeOnSphere(H_gravity, c_gravity, gravity);
  const Eigen::VectorXd x = rest_ldlt.solve(c.tail(rest) - H_rest_gravity * result.gravity);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    result.velocities.push_back(x.segment<3>(3 * static_cast<Eigen::Index>(k)));
  }
  result.accelerometer_bias = motions.front().bias.accelerometer + x.tail<3>();
  return result;
}

}  // namespace mlvi::internal

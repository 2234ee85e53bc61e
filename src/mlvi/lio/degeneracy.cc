// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/degeneracy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace mlvi {
namespace {

constexpr double kSteadyCosine = 0.995;
constexpr double kSteadyGain = 0.02;

struct Half {
  int count = 0;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

// Judges the three directions that start at row `offset` (0 translation, 3 rotation). `other_sigma`
// is the loosest sensible knowledge of the other three; it keeps the Schur complement finite when
// those are degenerate themselves.
Half Judge(const Matrix6d& A, const Matrix6d& feigned, int offset, double max_sigma,
           double other_sigma, double max_noise_share) {
  const int other = 3 - offset;
  const Eigen::Matrix3d coupling = A.block<3, 3>(other, offset);
  const Eigen::Matrix3d regular =
      A.block<3, 3>(other, other) + Eigen::Matrix3d::Identity() / (other_sigma * other_sigma);
  // Motion of the other three that follows a unit motion of these at least cost.
  const Eigen::Matrix3d follow = -regular.ldlt().solve(coupling);
  Eigen::Matrix<double, 6, 3> motion;
  motion.middleRows<3>(offset).setIdentity();
  motion.middleRows<3>(other) = follow;
  const Eigen::Matrix3d total = motion.transpose() * A * motion;
  const Eigen::Matrix3d noise = motion.transpose() * feigned * motion;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(total - noise);
  Half half{.count = 0, .axes = solver.eigenvectors()};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = solver.eigenvectors().col(i);
    const bool unknown = solver.eigenvalues()[i] < 1.0 / (max_sigma * max_sigma);
    const bool spurious = axis.dot(noise * axis) > max_noise_share * axis.dot(total * axis);
    if (!unknown && !spurious) continue;
    half.axes.col(i).swap(half.axes.col(half.count++));
  }
  return half;
}

// The mean of a lone degenerate axis over the last sweeps, while it stays within 6 degrees.
void Steady(const Eigen::Vector3d& before, Half& translation) {
  Eigen::Vector3d axis = translation.axes.col(0);
  if (std::abs(axis.dot(before)) < kSteadyCosine) return;
  axis *= axis.dot(before) < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d steady = ((1.0 - kSteadyGain) * before + kSteadyGain * axis).normalized();
  translation.axes.leftCols<1>() = steady;
  translation.axes.col(1) =
      (translation.axes.col(1) - steady * steady.dot(translation.axes.col(1))).normalized();
  translation.axes.col(2) = steady.cross(translation.axes.col(1));
}

}  // namespace

DegenerateDirections FindDegeneracy(const Matrix6d& information, const Matrix6d& feigned,
                                    const Eigen::Quaterniond& R_world_body,
                                    const std::optional<Eigen::Vector3d>& last_axis,
                                    const DegeneracyConfig& config) {
  DegenerateDirections result;
  Half translation =
      Judge(information, feigned, 0, config.max_translation_sigma, 1.0, config.max_noise_share);
  if (translation.count == 1) {
    if (last_axis) Steady(*last_axis, translation);
    result.lone_axis = translation.axes.col(0);
  }
  const Half rotation =
      Judge(information, feigned, 3, config.max_rotation_sigma, 1.0, config.max_noise_share);
  for (int i = 0; i < translation.count; ++i) {
    result.motions.push_back(
        (Vector6d() << translation.axes.col(i), Eigen::Vector3d::Zero()).finished());
  }
  for (int i = 0; i < rotation.count; ++i) {
    result.motions.push_back(
        (Vector6d() << Eigen::Vector3d::Zero(), rotation.axes.col(i)).finished());
  }
  const Eigen::Matrix3d R = R_world_body.toRotationMatrix();
  Degeneracy& report = result.report;
  report.translation_directions = translation.count;
  report.translation_axes = translation.axes;
  report.rotation_directions = rotation.count;
  report.rotation_axes = R * rotation.axes;
  return result;
}

void Strike(int translation, DegenerateDirections& directions) {
  Degeneracy& report = directions.report;
  directions.motions.erase(directions.motions.begin() + translation);
  for (int i = translation; i + 1 < report.translation_directions; ++i) {
    report.translation_axes.col(i).swap(report.translation_axes.col(i + 1));
  }
  --report.translation_directions;
}

void Deflate(const std::vector<Vector6d>& motions, Matrix6d& A, Vector6d& b) {
  for (const Vector6d& motion : motions) {
    const Vector6d Av = A * motion;
    const double vAv = motion.dot(Av);
    if (vAv <= 0.0) continue;
    b -= Av * (motion.dot(b) / vAv);
    A -= Av * Av.transpose() / vAv;
  }
}

}  // namespace mlvi

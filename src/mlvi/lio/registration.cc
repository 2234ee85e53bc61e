// SPDX-FileCopyrightText: 2026 The mlvi authors
// SPDX-License-Identifier: Apache-2.0
#include "mlvi/lio/registration.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "mlvi/lio/weak_axes.h"

namespace mlvi {
namespace {

constexpr int kSolvesPerAssociation = 2;
using PoseColumnsMatrix = Eigen::Matrix<double, kFilterSize, 6>;

// d(BoxMinus(x boxplus d, prior)) / d(d): identity but for the rotation.
FilterMatrix PriorJacobian(const FilterState& x, const FilterState& prior) {
  FilterMatrix J = FilterMatrix::Identity();
  J.block<3, 3>(nav_index::kRotation, nav_index::kRotation) =
      RightJacobianInverseSo3(BoxMinus(x, prior).segment<3>(nav_index::kRotation));
  return J;
}

// Information of the chart (world position, body rotation) in that of BoxMinus.
Matrix6d InPoseChart(const Matrix6d& information, const Eigen::Matrix3d& R_world_body) {
  Matrix6d J = Matrix6d::Identity();
  J.topLeftCorner<3, 3>() = R_world_body;
  return J.transpose() * information * J;
}

PoseColumnsMatrix PoseColumns(const FilterMatrix& P) {
  PoseColumnsMatrix columns;
  columns << P.middleCols<3>(nav_index::kPosition), P.middleCols<3>(nav_index::kRotation);
  return columns;
}

// The optimum of prior and measurement, both expressed in the tangent space at the prior mean.
struct Update {
  FilterVector displacement;  // from the prior mean
  FilterMatrix covariance;
};

// The prior covariance given that the blind motions are exactly known. A gain taken from it leaves
// the estimate where it is along them. (The whole prior's gain would move it: the axis that a
// registration finds and that of earlier ones differ by noise, and where the prior leaves 2 m open,
// 1 mm across under a direction 1e-3 off asks for 0.8 m along it.)
FilterMatrix GivenMotions(const FilterMatrix& P, const std::vector<Vector6d>& motions) {
  FilterMatrix given = P;
  for (const Vector6d& motion : motions) {
    const FilterVector with_motion = PoseColumns(given) * motion;
    FilterVector s = FilterVector::Zero();
    s.segment<3>(nav_index::kPosition) = motion.head<3>();
    s.segment<3>(nav_index::kRotation) = motion.tail<3>();
    const double variance = s.dot(with_motion);
    if (variance > 0.0) given -= with_motion * with_motion.transpose() / variance;
  }
  return given;
}

// Minimises |d|^2_P + sum w (z + h J^-1 (d - e))^2, e = x boxminus prior, J as above, with nothing
// known along the `blind` motions, which A and b do not contain. With S selecting the pose and P'
// the prior covariance given these motions,
//   K = P' S^T (I + A P'_ss)^-1,   d = -K b,   P+ = (I - K A S) P (I - K A S)^T + K A K^T.
Update Solve(const StateEstimate& prior, const FilterState& x, Matrix6d A, Vector6d b,
             const std::vector<Vector6d>& blind) {
  Matrix6d J_inverse = Matrix6d::Identity();
  const FilterVector e = BoxMinus(x, prior.mean);
  J_inverse.bottomRightCorner<3, 3>() = RightJacobianSo3(e.segment<3>(nav_index::kRotation));
  Vector6d e_pose;
  e_pose << e.segment<3>(nav_index::kPosition), e.segment<3>(nav_index::kRotation);
  b = J_inverse.transpose() * (b - A * J_inverse * e_pose);
  A = J_inverse.transpose() * A * J_inverse;
  const FilterMatrix given = GivenMotions(prior.covariance, blind);
  const Matrix6d M = Matrix6d::Identity() + A * PoseCovariance(given);
  const PoseColumnsMatrix K = PoseColumns(given) * M.inverse();
  FilterMatrix L = FilterMatrix::Identity();
  const PoseColumnsMatrix KA = K * A;
  L.middleCols<3>(nav_index::kPosition) -= KA.leftCols<3>();
  L.middleCols<3>(nav_index::kRotation) -= KA.rightCols<3>();
  Update update;
  update.displacement = -K * b;
  update.covariance = L * prior.covariance * L.transpose() + KA * K.transpose();
  update.covariance = (0.5 * (update.covariance + update.covariance.transpose())).eval();
  return update;
}

// Rigs tell the noise of their LiDAR generously or not at all well, and maps are as good as the
// sweeps they are made of: the constraints claim what their residuals at `T_world_body` show.
// Robust weights are then in units of that noise, too.
void ClaimWhatResidualsShow(const Pose3& T_world_body, const RegistrationConfig& config,
                            std::vector<Correspondence>& correspondences,
                            std::vector<Correspondence>& marks) {
  const double scale = std::clamp(NoiseScale(correspondences, T_world_body), config.min_noise_scale,
                                  config.max_noise_scale);
  for (Correspondence& c : correspondences) c.variance *= scale * scale;
  for (Correspondence& c : marks) c.variance *= scale * scale;
}

// Covariance of a pose that the next association may move again by the last step.
Matrix6d Unsettled(const FilterVector& step) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(step.segment<3>(nav_index::kPosition).norm()),
      Eigen::Vector3d::Constant(step.segment<3>(nav_index::kRotation).norm());
  return sigma.cwiseAbs2().asDiagonal();
}

bool Small(const FilterState& a, const FilterState& b, const RegistrationConfig& config) {
  const FilterVector step = BoxMinus(a, b);
  return step.segment<3>(nav_index::kPosition).norm() < config.step_tolerance_m &&
         step.segment<3>(nav_index::kRotation).norm() < config.step_tolerance_rad;
}

}  // namespace

RegistrationResult Register(const SweepFeatures& features, const LocalMap& map,
                            const StateEstimate& prior, const LidarSpec& lidar,
                            const std::optional<Eigen::Vector3d>& last_axis,
                            const RegistrationConfig& config, const DegeneracyConfig& degeneracy) {
  RegistrationResult result;
  result.estimate = prior;
  result.offered = static_cast<int>(features.planes.size() + features.edges.size());
  Viewpoint view{.T_world_body = prior.mean.nav.T_world_body,
                 .pose_covariance = PoseCovariance(prior.covariance),
                 .p_body_lidar = lidar.T_body_lidar.translation(),
                 .range_noise = lidar.range_noise,
                 .beam_noise = lidar.beam_noise};
  FilterState x = prior.mean;
  FilterVector step = FilterVector::Zero();
  while (!result.converged && result.iterations < config.max_iterations) {
    ++result.iterations;
    view.T_world_body = x.nav.T_world_body;
    std::vector<Correspondence> correspondences = Associate(features, map, view, config);
    std::vector<Correspondence> marks;
    if (last_axis) marks = AssociateMarks(features, map, view, *last_axis, config);
    ClaimWhatResidualsShow(x.nav.T_world_body, config, correspondences, marks);
    const bool last = result.iterations == config.max_iterations;
    const Matrix6d unsettled = last ? Unsettled(step) : Matrix6d::Zero();
    const FilterState before = x;
    for (int solve = 0; solve < kSolvesPerAssociation; ++solve) {
      PoseNormalEquations sums = Linearize(correspondences, x.nav.T_world_body, config);
      result.correspondences = sums.inliers;
      result.rms_residual =
          sums.weights > 0.0 ? std::sqrt(sums.weighted_squares / sums.weights) : 0.0;
      if (sums.inliers < config.min_correspondences) return result;
      const Matrix6d common = DeskewCovariance(features.deskew, sums.parts) + unsettled;
      DegenerateDirections directions = FindDegeneracy(
          sums.A, sums.feigned, x.nav.T_world_body.rotation(), last_axis, degeneracy);
      LeaveOutFeigned(correspondences, marks, x.nav.T_world_body, config, degeneracy, sums,
                      directions);
      AddCommonError(common, sums.A, sums.b);
      const Update update = Solve(prior, x, sums.A, sums.b, directions.motions);
      const FilterState next = BoxPlus(prior.mean, update.displacement);
      const FilterMatrix J_inverse = PriorJacobian(next, prior.mean).inverse();
      result.estimate = {next, J_inverse * update.covariance * J_inverse.transpose()};
      result.degeneracy = directions.report;
      result.degeneracy.information = InPoseChart(sums.A, x.nav.T_world_body.R());
      result.lone_axis = directions.lone_axis;
      const bool small = Small(next, x, config);
      x = next;
      if (small) break;
    }
    step = BoxMinus(x, before);
    result.converged = Small(x, before, config);
    // The pose becomes certain step by step: the gate for outliers closes, whatever the prior was.
    view.pose_covariance *= 0.25;
  }
  return result;
}

}  // namespace mlvi
